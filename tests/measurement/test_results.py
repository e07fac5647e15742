# SPDX-License-Identifier: BSD-3-Clause
"""Results are computed once, and the last ones are kept."""

from skidyn.measurement._results import Results


def test_a_result_is_computed_once_for_every_key():
    calls, results = [], Results()

    def squared(x, most=None):
        return results.get("squared", x, lambda: calls.append(x) or x**2, most)

    assert [squared(x) for x in (2, 3, 2)] == [4, 9, 4] and calls == [2, 3]
    assert results.get("negative", 2, lambda: -2) == -2


def test_only_the_last_results_of_a_name_are_kept():
    calls, results = [], Results()
    for x in (1, 2, 3, 2, 1):
        results.get("one", x, lambda x=x: calls.append(x), 2)
    assert calls == [1, 2, 3, 1]
