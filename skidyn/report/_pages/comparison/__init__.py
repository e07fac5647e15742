# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the page of a comparison, each a module and a template."""
