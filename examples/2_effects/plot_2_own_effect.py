# SPDX-License-Identifier: BSD-3-Clause
"""
Add an effect of your own
=========================

An arm cleans a tank: below some angle its forearm dips into a liquid, whose drag grows with the
square of the speed. This effect is not in the catalogue. At first the diagnosis reports an unknown
effect; then the effect is defined in a dozen lines, and is searched, identified and reported like
any other.
"""

# %%
# The drag on the second joint of a planar arm is added to the simulated torque.
import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import Coefficient, Effect, Shape, register_effect
from skidyn.identification import RBDRegressor
from skidyn.inspection import ErrorBudgetDisplay

log = make_hidden_effect_log(load_planar_arm(), None, random_state=3)
q, dq = log.frame["q2"].to_numpy(), log.frame["dq2"].to_numpy()
TRUE_ENTRY, TRUE_DRAG = 0.35, 2.0
y = log.y.copy()
y[:, 1] += TRUE_DRAG * np.maximum(0, q - TRUE_ENTRY) * dq * np.abs(dq)

# %%
# Without the effect in the catalogue, the largest finding is an unknown effect that depends on the
# motion of the second joint.
model = RBDRegressor(log.robot)
nameless = diagnose(model, log.X, y)
print("verdict:", nameless.verdict)
print(nameless.findings[0].sentence)


# %%
# An effect consists of its name, its coefficients with unit and sign, its shape parameters with
# unit, initial grid and range, the effects with which it may be confused, and its column.
class LiquidDrag(Effect):
    """Drag of a liquid that the link dips into."""

    kind = "liquid_drag"
    title = "Drag of a liquid"
    formula = r"c\,\max(0, q - q_0)\,\dot q\,|\dot q|"
    coefficients = (Coefficient("c", "N m s^2/rad^3", sign=1),)
    shapes = (Shape("entry", "rad", (-1.0, 0.0, 1.0), -3.0, 3.0, spacing="linear"),)
    rivals = ("nonlinear_viscous", "position_dependent_friction")
    separating_motion = "equal fast sweeps inside and outside the liquid"
    reference = "Morison, Johnson, Schaaf, O'Brien (1950), J. Petroleum Technology 2(5)."

    def columns(self, signals, joint, *, entry):
        """Torque per unit coefficient, one column."""
        dip = np.maximum(0.0, signals.q[:, joint] - entry)
        return (dip * signals.dq[:, joint] * np.abs(signals.dq[:, joint]))[:, None]


register_effect(LiquidDrag)

# %%
# With the effect in the catalogue, it is found with its size.
diagnosis = diagnose(model, log.X, y)
for finding in diagnosis.findings:
    print(finding.sentence)
    for name, value in finding.parameters.items():
        print(f"    {name}: {value['value']:.3g} {value['unit']}")
print(f"true: c = {TRUE_DRAG}, entry = {TRUE_ENTRY} rad")
ErrorBudgetDisplay.from_diagnosis(diagnosis, joint=2)
plt.show()
