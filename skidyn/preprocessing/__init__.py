# SPDX-License-Identifier: BSD-3-Clause
"""Transformers and dataset functions that prepare logs."""
