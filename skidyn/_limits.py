# SPDX-License-Identifier: BSD-3-Clause
"""Limits of the size of a log, above which it is damaged or malicious."""

#: Most columns of one log, and most letters of a column's name.
MOST_COLUMNS, LONGEST_NAME = 10_000, 250
