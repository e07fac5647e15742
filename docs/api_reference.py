# SPDX-License-Identifier: BSD-3-Clause
"""The one table of skidyn's public API: which page tells of what, and in which order.

The API pages are generated from it, and ``tests/whole/test_public_api.py`` checks that every public
symbol is in it exactly once.
"""

from typing import NamedTuple


class Section(NamedTuple):
    """Some symbols of a module that belong together."""

    title: str
    names: tuple[str, ...]


class Page(NamedTuple):
    """The page of one module; the sentence says what a reader finds in it."""

    module: str
    sentence: str
    sections: tuple[Section, ...]


PAGES: tuple[Page, ...] = (
    Page(
        "skidyn",
        "What the package itself offers.",
        (
            Section("Versions", ("show_versions",)),
            Section("Models on disk", ("load_model", "save_model")),
        ),
    ),
    Page(
        "skidyn.robots",
        "Robots from URDF files: joints, limits, inertial parameters and dynamics.",
        (
            Section("Classes", ("BaseParameters", "Robot")),
            Section("Functions", ("find_base_parameters",)),
        ),
    ),
    Page(
        "skidyn.identification",
        "Identification of rigid bodies together with effects; consistency; uncertainty.",
        (
            Section(
                "Classes",
                (
                    "BodyConstraints",
                    "RBDRegressor",
                ),
            ),
            Section(
                "Functions",
                (
                    "bootstrap_coefficients",
                    "is_consistent",
                    "make_consistent",
                    "regressor_from_evidence",
                    "repetition_instruments",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.effects",
        "The catalogue of physical effects and how to add one.",
        (
            Section(
                "Classes",
                (
                    "Coefficient",
                    "Effect",
                    "FrictionTransformer",
                    "Shape",
                    "Term",
                    "TermSum",
                ),
            ),
            Section(
                "Functions",
                (
                    "dahl_state",
                    "formula",
                    "get_effect",
                    "list_effects",
                    "make_terms",
                    "register_effect",
                    "stop_state",
                    "unregister_effect",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.evidence",
        "Least-squares evidence of trajectories: merged, left out, solved.",
        (
            Section("Classes", ("Evidence",)),
            Section("Functions", ("evidence_from_motion", "evidence_from_parquet")),
        ),
    ),
    Page(
        "skidyn.diagnosis",
        "The loop: compare, see where it fails, learn what is missing, add it.",
        (
            Section(
                "Classes",
                (
                    "Comparison",
                    "Confirmation",
                    "Diagnosis",
                    "EffectSearchCV",
                    "Failure",
                    "Finding",
                    "Limit",
                    "ParquetDiagnosis",
                    "Place",
                    "Proposal",
                    "RestError",
                    "SeparatingMotion",
                    "Settings",
                    "UnknownTorque",
                    "VariableTest",
                ),
            ),
            Section("Functions", ("design_separating_motion", "diagnose", "diagnose_parquet")),
        ),
    ),
    Page(
        "skidyn.explorer",
        "The loop by hand on a local page, and what it does without one.",
        (
            Section("Classes", ("RankedEffect", "Session")),
            Section("Functions", ("serve",)),
        ),
    ),
    Page(
        "skidyn.payload",
        "What a robot carries, and torque per ampere from a known load.",
        (
            Section("Classes", ("DriveGainEstimate", "PayloadEstimate")),
            Section("Functions", ("estimate_drive_gains", "identify_payload")),
        ),
    ),
    Page(
        "skidyn.simulation",
        "Fitted models run forward: their motion, and how far it is from that of the robot.",
        (
            Section(
                "Classes", ("Controller", "ServoFinding", "SimulationErrors", "SimulationVerdict")
            ),
            Section(
                "Functions",
                (
                    "explain_servo_motion",
                    "fit_bam_servo",
                    "fit_controller",
                    "fit_servo",
                    "judge_additions",
                    "judge_by_simulation",
                    "neg_simulation_error",
                    "servo_torque",
                    "simulate",
                    "simulate_bam_servo",
                    "simulate_closed_loop",
                    "simulation_errors",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.excitation",
        "Motions from which the parameters of a robot can be told.",
        (
            Section("Classes", ("Excitation", "MotionLimits")),
            Section("Functions", ("design_excitation",)),
        ),
    ),
    Page(
        "skidyn.inspection",
        "Pictures of torque, residuals, error budgets and error maps.",
        (
            Section(
                "Classes",
                (
                    "ErrorBudgetDisplay",
                    "ErrorMapDisplay",
                    "ResidualDisplay",
                    "TorqueDisplay",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.report",
        "A diagnosis, two compared, or a fleet, as JSON and as one HTML page.",
        (
            Section(
                "Functions",
                (
                    "render_html",
                    "summarize",
                    "summarize_comparison",
                    "summarize_fleet",
                    "write_html",
                    "write_json",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.logs",
        "Readers of recordings, and the checks of a log.",
        (
            Section("Classes", ("Channel", "JointQuality", "LogQuality")),
            Section("Functions", ("check_log", "load_recording", "read_log", "register_reader")),
        ),
    ),
    Page(
        "skidyn.exceptions",
        "Errors, all of them a ValueError that says how to fix the input, and warnings.",
        (
            Section(
                "Errors",
                (
                    "SkidynError",
                    "ColumnError",
                    "EffectError",
                    "LogError",
                    "MisreadLogError",
                    "RobotDescriptionError",
                ),
            ),
            Section("Warnings", ("LogWarning", "RobotDescriptionWarning")),
        ),
    ),
    Page(
        "skidyn.measurement",
        "Is a log what its owner thinks it is? Checks before physics is blamed.",
        (
            Section("Classes", ("Check", "Measurement", "Remedy", "Suspicion")),
            Section(
                "Functions",
                ("check_measurement", "list_checks", "refuse_certain", "regular_clock"),
            ),
        ),
    ),
    Page(
        "skidyn.datasets",
        "Embedded robots, simulated logs with a hidden effect, public recordings to download.",
        (
            Section("Classes", ("SuiteCase",)),
            Section(
                "Functions",
                (
                    "fetch_recording",
                    "hidden_effect_kinds",
                    "hidden_effect_suite",
                    "load_demo_log",
                    "load_panda",
                    "load_planar_arm",
                    "load_scara",
                    "load_srs_arm",
                    "load_ur10e",
                    "load_ur5",
                    "make_hidden_effect_log",
                    "score_answers",
                    "wilson_interval",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.preprocessing",
        "Currents to torques, filters, derivatives, scaling, repeated trajectories.",
        (
            Section(
                "Classes",
                (
                    "ButterworthFilter",
                    "CurrentToTorque",
                    "DelayEstimate",
                    "DropKeys",
                    "SignalScaler",
                    "SmoothDerivatives",
                    "TimeDerivative",
                ),
            ),
            Section(
                "Functions",
                (
                    "advance_channels",
                    "average_repetitions",
                    "cross_fitted_residual",
                    "estimate_delay",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.model_selection",
        "Splits by trajectory and phase, a leakage guard, learning curves.",
        (
            Section(
                "Classes",
                (
                    "LeakageGuard",
                    "LeakageWarning",
                    "PhaseKFold",
                    "TrajectoryKFold",
                ),
            ),
            Section(
                "Functions",
                (
                    "leakage_report",
                    "trajectory_learning_curve",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.metrics",
        "Errors per joint, scorers, paired comparison of two models.",
        (
            Section("Classes", ("Drift", "PairedComparison")),
            Section(
                "Functions",
                (
                    "SCORERS",
                    "drift",
                    "joint_error_table",
                    "joint_scores",
                    "max_absolute_error",
                    "min_absolute_error",
                    "paired_comparison",
                    "percent_improvement",
                    "rmse_over_range",
                    "trajectory_errors",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.neural_network",
        "LSTM regressors without and with the rigid body.",
        (
            Section(
                "Classes",
                (
                    "BLLRegressor",
                    "LSTMRegressor",
                    "NDLRegressor",
                    "SDLRegressor",
                    "TorqueStream",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.committee",
        "Committees of extreme learning machines.",
        (Section("Classes", ("ELMCommittee",)),),
    ),
    Page(
        "skidyn.hybrid",
        "Physics plus a learner of its residual that knows when to add nothing.",
        (
            Section(
                "Classes",
                (
                    "HybridRegressor",
                    "OwnJointRegressor",
                ),
            ),
        ),
    ),
    Page(
        "skidyn.fleet",
        "Many robots of one type: common parameters, deviations, drift.",
        (
            Section("Classes", ("DriftReport", "FleetComparison")),
            Section("Functions", ("compare_fleet", "monitor_drift")),
        ),
    ),
    Page(
        "skidyn.forecasting",
        "Forecasts from past torque, which every forecast must beat.",
        (
            Section(
                "Classes",
                (
                    "AutoregressiveRegressor",
                    "PersistenceRegressor",
                ),
            ),
            Section("Functions", ("forecast_table",)),
        ),
    ),
    Page(
        "skidyn.export",
        "An identified model as a function, as a description of the robot, for ROS 2 and for BAM.",
        (
            Section(
                "Files",
                ("write_c", "write_mjcf", "write_onnx", "write_python", "write_ros2", "write_urdf"),
            ),
            Section("Your own files", ("merge_mjcf", "merge_urdf", "merge_usd")),
            Section("Servos", ("BamModel", "fit_bam", "read_bam", "write_bam")),
            Section("In memory", ("c_source", "python_source", "to_onnx")),
            Section("Log viewers", ("write_traces",)),
        ),
    ),
)
