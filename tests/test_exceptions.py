# SPDX-License-Identifier: BSD-3-Clause
"""What a user may catch."""

import pytest

from skidyn import exceptions


@pytest.mark.parametrize("name", exceptions.__all__)
def test_every_error_is_a_value_error_and_every_warning_one_of_the_user(name):
    kind = getattr(exceptions, name)
    if name.endswith("Warning"):
        assert issubclass(kind, UserWarning)
    else:
        assert issubclass(kind, exceptions.SkidynError) and issubclass(kind, ValueError)
