# SPDX-License-Identifier: BSD-3-Clause
"""Pages as lists of pictures: each is a module in the folder of its page, with a template."""
