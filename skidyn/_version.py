# SPDX-License-Identifier: BSD-3-Clause
"""Versions of skidyn, Python and dependencies."""

import platform
import sys

# In order of relevance for a bug report: skidyn, its dependencies, then extras.
_CORE = (
    "skidyn",
    "scikit-learn",
    "skorch",
    "torch",
    "pytorch-kinematics",
    "numpy",
    "scipy",
    "pandas",
    "joblib",
)
_OPTIONAL = (
    "matplotlib", "jinja2", "polars", "pyarrow", "h5py", "mcap", "rosbags", "rich",
    "onnx", "skops", "pooch", "dask",
)  # fmt: skip


def package_version(package: str = "skidyn") -> str:
    """Version of an installed distribution, ``"not installed"`` where there is none."""
    # importlib.metadata imports the email package, which would slow every import of skidyn
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def versions() -> dict[str, str]:
    """Versions of Python, the platform, skidyn, its dependencies and its optional packages.

    Nothing is imported: the versions are read from the installed metadata. The path of the
    interpreter is irrelevant for numbers and reveals the user, so it is not among them.
    """
    environment = {"python": sys.version.split()[0], "platform": platform.platform()}
    return environment | {name: package_version(name) for name in (*_CORE, *_OPTIONAL)}


def show_versions() -> None:
    """Print the versions that a bug report needs.

    Nothing is imported: the versions are read from the installed metadata.

    Examples
    --------
    >>> import skidyn
    >>> skidyn.show_versions()  # doctest: +ELLIPSIS
    python: 3...
    """
    for name, value in (versions() | {"executable": sys.executable}).items():
        print(f"{name}: {value}")
