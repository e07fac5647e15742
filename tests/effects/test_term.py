# SPDX-License-Identifier: BSD-3-Clause
"""What a term knows of its effect, and sums of terms."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import (
    Coefficient,
    Effect,
    Term,
    TermSum,
    formula,
    make_terms,
    register_effect,
    unregister_effect,
)
from skidyn.exceptions import EffectError
from skidyn.identification import RBDRegressor


class StickyGrease(Effect):
    """A user's own dry friction, written with NumPy's sign."""

    kind = "sticky_grease"
    title = "Sticky grease"
    formula = r"F\,\mathrm{sign}(\dot q)\,(1 + q^2)"
    coefficients = (Coefficient("F", "N m", sign=1),)

    def columns(self, signals, joint, **shape):
        q, dq = signals.q[:, joint], signals.dq[:, joint]
        return (np.sign(dq) * (1 + q**2))[:, None]


class Warming(Effect):
    """A user's own effect with a state, which starts anew in every segment."""

    kind = "warming"
    title = "Warming"
    formula = r"\int |\dot q|"
    coefficients = (Coefficient("w", "N m"),)

    def columns(self, signals, joint, **shape):
        column = np.zeros(signals.n_samples)
        for rows in signals.segments:
            column[rows] = np.cumsum(np.abs(signals.dq[rows, joint]))
        return column[:, None]


@pytest.fixture
def own_effects():
    register_effect(StickyGrease)
    register_effect(Warming)
    yield
    unregister_effect("sticky_grease")
    unregister_effect("warming")


def test_joints_are_counted_from_1():
    assert Term("dahl", (2,)).places == (1,)
    assert Term.at("dahl", [1]) == Term("dahl", (2,))
    assert make_terms([("dahl", [2])], 2) == [Term("dahl", (2,))]
    with pytest.raises(EffectError, match="counted from 1"):
        Term("dahl", (0,))


def test_a_term_knows_its_columns():
    term = Term("coupled_friction", (5, 6), {"ratio": 1.0})
    assert term.names == ("coupled_friction.Fc[5,6]", "coupled_friction.Fv[5,6]")
    assert term.width == 2
    assert term.signs.tolist() == [1.0, 1.0]
    assert Term("time_delay", (1,)).limits.tolist() == [0.1]


def test_what_is_stored_of_a_term_is_what_it_was_made_of():
    term = Term("dahl", (1,), {"presliding": 0.02})
    assert hash(term) == hash(Term("dahl", (1,), {"presliding": 0.02}))
    assert term.__getstate__() == {"kind": "dahl", "joints": (1,), "shape": {"presliding": 0.02}}


def test_a_sum_of_terms_has_one_block_of_coefficients():
    whole = Term("viscous", (1,)) + Term("asymmetric_friction", (1,)) + [Term("offset", (2,))]
    assert isinstance(whole, TermSum)
    assert whole.width == 4
    assert whole.names[-1] == "offset.tau0[2]"
    assert whole.signs.tolist() == [1.0, 0.0, 0.0, 0.0]
    places = dict(whole.slices(10))
    assert places[Term("asymmetric_friction", (1,))] == slice(11, 13)


def test_a_changed_shape_is_another_term():
    term = Term("stribeck", (1,), {"vs": 0.1, "delta": 2.0})
    assert term.with_shape(vs=0.2) == Term("stribeck", (1,), {"vs": 0.2, "delta": 2.0})
    assert Term("stribeck", (1,)).is_open
    assert not term.is_open
    assert not Term("viscous", (1,)).is_open


@pytest.mark.parametrize(
    ("term", "dry"),
    [
        (Term("viscous", (1,)), False),
        (Term("coulomb", (4,)), True),
        (Term("offset", (1,)), False),
        (Term("stribeck", (1,), {"vs": 0.1, "delta": 2.0}), True),
        (Term("load_dependent_friction", (1,)), True),
        (Term("coupled_friction", (5, 6), {"ratio": -1.0}), True),
        (Term("dahl", (1,), {"presliding": 0.02}), False),
        (Term("time_delay", (1,)), False),
        (formula("sign(dq2) * cos(q1)", joint=2), True),
        (formula("dq2 * cos(q1)", joint=2), False),
    ],
)
def test_dry_friction_is_known_by_its_columns(term, dry):
    assert term.is_dry is dry


@pytest.mark.parametrize(
    ("term", "pointwise"),
    [
        (Term("viscous", (1,)), True),
        (Term("nonlinear_viscous", (1,), {"power": 2.0}), True),
        (Term("dahl", (1,), {"presliding": 0.02}), False),
        (Term("time_delay", (1,)), False),
        (Term("payload", (1, 2)), False),
        (formula("t * dq1", joint=1), False),
    ],
)
def test_a_memory_is_known_by_the_columns(term, pointwise):
    assert term.is_pointwise is pointwise


def test_a_users_own_effect_needs_no_list(own_effects):
    assert Term("sticky_grease", (1,)).is_dry
    assert Term("sticky_grease", (1,)).is_pointwise
    assert not Term("warming", (1,)).is_dry
    assert not Term("warming", (1,)).is_pointwise


def test_a_users_own_dry_friction_does_not_spike_in_a_delay(own_effects):
    """What lags is the smooth part of the torque, whichever effect is the dry one."""
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    delay = Term("time_delay", (1,))
    plain = RBDRegressor(log.robot, ["viscous", delay]).fit(log.X, log.y)
    own = RBDRegressor(log.robot, ["viscous", ("sticky_grease", [1]), delay]).fit(log.X, log.y)
    own.effect_coefficients_[delay][:] = 1.0
    seen = own.predict(log.X)
    own.effect_coefficients_[delay][:] = 0.0
    late = (seen - own.predict(log.X))[:, 0]
    own.effect_coefficients_[Term("sticky_grease", (1,))][:] = 1e6
    assert plain.coef_.shape == (len(own.coef_) - 1,)
    without = own.predict(log.X)
    own.effect_coefficients_[delay][:] = 1.0
    assert np.allclose((own.predict(log.X) - without)[:, 0], late, atol=1e-6)


def test_a_term_knows_whether_it_has_the_plain_form_of_its_kind():
    assert not Term("asymmetric_friction", (1,)).is_further_form
    assert Term("asymmetric_friction", (1,), {"power": 2.0}).is_further_form
    assert not Term("end_stop", (1,), {"q_lim": 0.3, "side": 1.0}).is_further_form


def test_an_effect_of_some_time_acts_then_only(signals):
    spans = ((1, 4.0, 5.0),)
    term = Term("offset", (1,), {"trajectories": (0, 1), "spans": spans})

    (column,) = term.torque_columns(signals)[0].T

    inside = (signals.trajectory == 0) | ((signals.clock >= 4.0) & (signals.clock <= 5.0))
    np.testing.assert_allclose(column, inside.astype(float))
    assert term.everywhere == Term("offset", (1,))


def test_an_effect_with_a_course_has_its_sizes(signals):
    time = signals.clock[signals.trajectory == 1]
    ends = float(time.min()), float(time.max())
    term = Term("offset", (1,), {"course": ((1, ends[0], 1.0, ends[1], 0.4),)})

    (column,) = term.torque_columns(signals)[0].T

    own = signals.trajectory == 1
    assert not column[~own].any()
    np.testing.assert_allclose(column[own], np.interp(time, ends, [1.0, 0.4]))
    assert term.everywhere == Term("offset", (1,))
    assert term.names != term.everywhere.names
