# SPDX-License-Identifier: BSD-3-Clause
"""How much a log may hold, where more is an accident or an attack."""

#: Columns of one log, and letters of a column's name.
MOST_COLUMNS, LONGEST_NAME = 10_000, 250
