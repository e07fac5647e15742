# SPDX-License-Identifier: BSD-3-Clause
"""Rigid-body models: dynamics, regressor, identification."""

__all__: list[str] = []
