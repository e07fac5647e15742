# SPDX-License-Identifier: BSD-3-Clause
"""Pictures at the end of every page."""
