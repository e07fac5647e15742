# SPDX-License-Identifier: BSD-3-Clause
"""
Velocities and accelerations from noisy positions
=================================================

Accelerations multiply the inertias, and differentiating a position twice multiplies its noise.
The right amount of smoothing can be found from the data: a smoother that predicts each sample well
from its neighbours, without the sample itself, neither follows the noise nor distorts the motion.
"""

# %%
# The derivatives of this motion are known. It is measured by an encoder with a resolution of 1e-3
# rad, and by one that is twenty times finer.
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from skidyn.preprocessing import SmoothDerivatives, TimeDerivative, advance_channels, estimate_delay

t = np.arange(4000) * 0.005
w = 2 * np.pi * np.array([0.2, 0.5, 1.1])


def motion(t, order=0):
    """Sum of three sines, or a derivative of it."""
    return (w**order * np.sin(t[:, None] * w + order * np.pi / 2)).sum(axis=1)


figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
for step in (5e-5, 1e-3):
    log = pd.DataFrame({"time": t, "q1": step * np.round(motion(t) / step)})
    smooth = SmoothDerivatives().set_output(transform="pandas")
    table = smooth.fit_transform(log)
    error = np.std(table["ddq1"] - motion(t, 2)) / np.std(motion(t, 2))
    print(
        f"encoder step {step:g} rad: {smooth.method_}, {smooth.cutoff_:.1f} Hz, error {error:.1%}"
    )
    choice = pd.DataFrame(smooth.cv_results_)
    own = choice[choice["method"] == smooth.method_]
    (line,) = left.loglog(own["cutoff"], np.sqrt(own["error"]), label=f"encoder step {step:g} rad")
    left.axvline(smooth.cutoff_, color=line.get_color(), ls=":")
left.set(xlabel="cut-off (Hz)", ylabel="left-out error (rad)")
left.legend()

rough = TimeDerivative(["q1"]).set_output(transform="pandas").fit_transform(log)
rough = TimeDerivative(["dq1"]).set_output(transform="pandas").fit_transform(rough)
window = slice(400, 800)
right.plot(t[window], rough["ddq1"][window], lw=0.5, color="0.7", label="differences")
right.plot(t[window], table["ddq1"][window], label="SmoothDerivatives")
right.plot(t[window], motion(t, 2)[window], "k:", label="true")
right.set(xlabel="time (s)", ylabel="acceleration (rad/s²)", ylim=(-90, 90))
right.legend()

# %%
# A second channel may be delayed. Here the velocity logged by the controller has passed a filter.
log["dq1"] = motion(t - 0.0125, 1)
found = estimate_delay(table["dq1"], log["dq1"], time=log["time"])
print(f"late by {1e3 * found.delay:.1f} ± {1e3 * found.standard_error:.1f} ms")
fixed = advance_channels(log, {"dq": found.delay})
rest = np.std(fixed["dq1"] - motion(fixed["time"].to_numpy(), 1))
print(f"error of the velocity {np.std(log['dq1'] - motion(t, 1)):.3f} -> {rest:.4f} rad/s")
plt.show()
