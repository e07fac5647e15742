# SPDX-License-Identifier: BSD-3-Clause
"""Evidence: a log averaged once into few rows, for identification and diagnosis."""

from skidyn.evidence._evidence import Evidence
from skidyn.evidence._from_motion import evidence_from_motion
from skidyn.evidence._streaming import evidence_from_parquet

__all__ = ["Evidence", "evidence_from_motion", "evidence_from_parquet"]

# For other packages of skidyn; no part of the public interface.
from skidyn.evidence._broken import (
    broken_notes as broken_notes,
    without_broken_positions as without_broken_positions,
)
from skidyn.evidence._evidence import column_names as column_names
from skidyn.evidence._felt import (
    Felt as Felt,
    felt_columns as felt_columns,
    gram_of as gram_of,
    products_with as products_with,
)
from skidyn.evidence._fit import (
    Fit as Fit,
    own_noise as own_noise,
    weighted_least_squares as weighted_least_squares,
)
from skidyn.evidence._folds import (
    RIDGE as RIDGE,
    Normal as Normal,
    column_sizes as column_sizes,
    fold_products as fold_products,
    fold_slices as fold_slices,
    jackknife as jackknife,
    jackknife_rows as jackknife_rows,
    kept_pull as kept_pull,
    left_out_coefficients as left_out_coefficients,
    left_out_errors as left_out_errors,
    soft_prior as soft_prior,
    solve_left_out as solve_left_out,
    without_each as without_each,
)
from skidyn.evidence._from_motion import (
    evidence_of_rows as evidence_of_rows,
    renumbered as renumbered,
    sample_blocks as sample_blocks,
)
from skidyn.evidence._kinematics import smooth_motion as smooth_motion
from skidyn.evidence._motion_rows import (
    SHORT_MARGIN as SHORT_MARGIN,
    read_motion as read_motion,
)
from skidyn.evidence._parquet import (
    ColumnMap as ColumnMap,
    read_trajectories as read_trajectories,
    trajectory_lengths as trajectory_lengths,
)
from skidyn.evidence._problem import (
    Problem as Problem,
    hysteresis_joints as hysteresis_joints,
    make_problem as make_problem,
    with_reversals as with_reversals,
    with_short_windows as with_short_windows,
)
from skidyn.evidence._rigid_rows import (
    independent_columns as independent_columns,
    regressor_rows as regressor_rows,
)
from skidyn.evidence._rows import (
    FEWEST_SAMPLES as FEWEST_SAMPLES,
    REST as REST,
    column_step as column_step,
    sliding_samples as sliding_samples,
    window_rows as window_rows,
)
from skidyn.evidence._shapes import (
    Gain as Gain,
    best_on_grid as best_on_grid,
    refine_term as refine_term,
)
from skidyn.evidence._streaming import (
    Options as Options,
    Source as Source,
    evidence_of_signals as evidence_of_signals,
    evidence_of_sources as evidence_of_sources,
    linear_terms as linear_terms,
    parquet_files as parquet_files,
)
