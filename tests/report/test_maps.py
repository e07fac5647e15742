# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn.report import summarize


def test_an_effect_of_two_variables_is_mapped(fakes):
    diagnosis = fakes.make_diagnosis("unknown")
    signals, comparison = diagnosis.comparison.signals, diagnosis.comparison
    comparison.predicted[:] = comparison.measured
    comparison.predicted[:, 1] -= signals.q[:, 0] + 10 * signals.q[:, 2]
    (table,) = summarize(diagnosis)["what"][1]["maps"]
    assert table["joint"] == 2 and table["units"] == ["rad", "m"]
    middles = [np.convolve(table[k], [0.5, 0.5], "valid") for k in ("x", "y")]
    expected = middles[0][None, :] + 10 * middles[1][:, None]
    values = np.array(table["table"], dtype=float)
    seen = np.isfinite(values)
    assert seen.sum() > 50
    assert values[seen] == pytest.approx(expected[seen], abs=0.8)


def test_named_effects_and_single_variables_have_no_map(fakes):
    assert all(not f["maps"] for f in summarize(fakes.make_diagnosis())["what"])
