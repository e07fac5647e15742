# SPDX-License-Identifier: BSD-3-Clause
"""Committee of extreme learning machines."""

from skidyn.committee._elm import ELMCommittee

__all__ = ["ELMCommittee"]
