# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the report page, each a module and a template, in the order of their ``place``."""
