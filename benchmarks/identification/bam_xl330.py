# SPDX-License-Identifier: BSD-3-Clause
"""Dynamixel XL330 on a pendulum, by BAM's own protocol: simulated from commands alone.

The sixteen recordings of BAM (Duclusaud et al., 2024; four motions, four gains) are simulated as
wholes from their commands; the error is the mean absolute error of the position, averaged over
recordings, in mrad. Parameters that BAM has published for this servo are read from its folder
``bam/params/xl330``. Ours are fitted to the recordings of three gains and tested on the fourth, in
turn; those that BAM published were fitted to recordings that may be among them.

    python benchmarks/identification/bam_xl330.py bam_pendulum.npz --published bam/params/xl330

With ``--in-bam``, BAM's own program (``pip install better-actuator-models``) is used for the
simulation instead of our time steps, with which our parameters were fitted.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
import pandas as pd

from skidyn.export import read_bam
from skidyn.robots import Robot
from skidyn.simulation import fit_bam_servo, simulate_bam_servo

#: Share of the voltage for each rad of error and unit of kp: encoder counts per rad over the
#: servo's divisor and the limit of its pulse width, as BAM states them.
GAIN = (4096 / (2 * np.pi)) / (256 * 885)
#: Step of the clock that BAM's own program gets, s.
BAM_STEP = 0.005
#: BAM's pendulum is a mass at the end of a rod without mass.
URDF = """<robot name="pendulum"><link name="stand"/>
  <link name="arm"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>
    <inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="servo" type="continuous"><parent link="stand"/><child link="arm"/>
    <axis xyz="0 1 0"/></joint></robot>"""


def read(path):
    """Recordings as a table with gain and voltage."""
    data = np.load(path)
    labels = [json.loads(str(label)) for label in data["traj_label"]]
    number = data["traj"]
    frame = pd.DataFrame(
        {
            "time": data["t"],
            "trajectory": number,
            "q1": data["q"][:, 0].astype(float),
            "dq1": data["dq"][:, 0].astype(float),
            "q_ref1": data["q_goal"][:, 0].astype(float),
            "enabled": data["torque_enable"][:, 0].astype(float),
            "kp": np.array([label["kp"] for label in labels])[number],
            "volts": np.array([label["vin"] for label in labels])[number],
        }
    )
    return frame, Robot.from_urdf(URDF.format(mass=labels[0]["mass"], z=-labels[0]["length"]))


def errors(servo, robot, frame):
    """Mean absolute error of every recording, mrad."""
    motion = simulate_bam_servo(
        servo, robot, frame, gain=GAIN * frame["kp"].to_numpy(), volts=frame["volts"].to_numpy()
    )
    apart = 1e3 * np.abs(motion["q1"] - frame["q1"])
    return apart.groupby(frame["trajectory"]).mean().to_numpy()


def errors_in_bam(servo, robot, frame):
    """The same with BAM's own program, whose clock is regular."""
    from bam.model import load_model_from_dict
    from bam.simulate import Simulator

    link = robot.inertial_parameters[0]
    apart = []
    for _, run in frame.groupby("trajectory"):
        t = run["time"].to_numpy() - run["time"].iloc[0]
        clock = np.arange(0, t[-1], BAM_STEP)
        on = run["enabled"].to_numpy()[np.searchsorted(t, clock, side="right") - 1]
        q, dq, goal = (np.interp(clock, t, run[c]) for c in ("q1", "dq1", "q_ref1"))
        keys = ("position", "speed", "goal_position", "torque_enable")
        log = {
            "mass": link[0],
            "length": abs(link[3]) / link[0],
            "arm_mass": 0.0,
            "kp": run["kp"].iloc[0],
            "vin": run["volts"].iloc[0],
            "dt": BAM_STEP,
            "entries": [
                dict(zip(keys, row, strict=True))
                for row in zip(q, dq, goal, on.astype(bool), strict=True)
            ],
        }
        model = load_model_from_dict(
            {**servo.parameters, "model": servo.name, "actuator": servo.actuator}
        )
        positions = Simulator(model).rollout_log(log, simulate_control=True)[0]
        apart.append(1e3 * np.mean(np.abs(np.array(positions) - q)))
    return np.array(apart)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--published", type=Path, help="folder with m1.json to m6.json")
    parser.add_argument("--models", nargs="*", default=["m1", "m2", "m3", "m4", "m5", "m6"])
    parser.add_argument("--in-bam", action="store_true", help="BAM's own program simulates")
    parser.add_argument("--gains", type=float, nargs="*", help="only these gains are left out")
    options = parser.parse_args()
    judge = errors_in_bam if options.in_bam else errors
    frame, robot = read(options.recordings)
    print(f"{'model':6s} {'published':>10s} {'left out':>10s} {'same':>10s} {'seconds':>8s}")
    for name in options.models:
        published = np.nan
        if options.published:
            published = judge(read_bam(options.published / f"{name}.json"), robot, frame).mean()
        start, left_out = time.perf_counter(), []
        every = [*sorted(frame["kp"].unique()), None]
        for kp in options.gains or every:
            train = frame[frame["kp"] != kp].reset_index(drop=True)
            test = frame[(frame["kp"] == kp) | (kp is None)].reset_index(drop=True)
            servo = fit_bam_servo(
                robot,
                train,
                gain=GAIN * train["kp"].to_numpy(),
                volts=train["volts"].to_numpy(),
                name=name,
                actuator="xl330",
            )
            found = judge(servo, robot, test)
            left_out += [] if kp is None else list(found)
            if options.gains:
                print(f"{name} without gain {kp:g}: {found.round(1)}", flush=True)
        seconds = time.perf_counter() - start
        print(
            f"{name:6s} {published:10.1f} {np.mean(left_out):10.1f} {found.mean():10.1f} "
            f"{seconds:8.0f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
