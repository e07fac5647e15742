# SPDX-License-Identifier: BSD-3-Clause
"""Pages as a row of pictures: each is a module of its page's folder with a template beside it."""
