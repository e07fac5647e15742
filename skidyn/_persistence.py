# SPDX-License-Identifier: BSD-3-Clause
"""Models on disk without pickle: whole files or none, and no foreign code on loading."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn._optional import import_optional

#: Largest model file once unpacked, in bytes.
MAX_BYTES = 4 * 2**30


def save_model(path: str | os.PathLike[str], model: Any) -> Path:
    """Store a fitted model with skops, in one step.

    Parameters
    ----------
    path : path
        File to write, for example ``model.skops``; it is replaced in one step, so that a full disk
        or a killed process leaves the old file.
    model : estimator
        Any estimator of skidyn, or of scikit-learn with estimators of skidyn inside.

    Returns
    -------
    path : Path
        The file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from sklearn.linear_model import Ridge
    >>> from skidyn import load_model, save_model
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_model(save_model(pathlib.Path(folder, "model.skops"), Ridge(alpha=2.0)))
    Ridge(alpha=2.0)
    """
    skops = import_optional("skops.io", extra="share")
    target = Path(path)
    data = skops.dumps(model)
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return target


def load_model(path: str | os.PathLike[str], *, trusted: Iterable[str] = ()) -> Any:
    """Load a model that :func:`save_model` stored.

    Parameters
    ----------
    path : path
        File.
    trusted : iterable of str, default=()
        Further types that may be created, by their full names, such as
        ``"my_package.MyRegressor"``. Types of skidyn are, and those that skops knows to be
        harmless.

    Returns
    -------
    estimator
        The model.

    Raises
    ------
    SkidynError
        The file is a pickle or damaged, unpacks to more than 4 GiB, or holds other types.

    Examples
    --------
    >>> from skidyn import load_model
    >>> load_model("model.skops").predict(X)  # doctest: +SKIP
    """
    skops = import_optional("skops.io", extra="share")
    source = Path(path)
    try:
        with zipfile.ZipFile(source) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except zipfile.BadZipFile as error:
        raise SkidynError(
            f"{source}: not a skops file. Pickles and joblib files are refused, since loading one "
            "can run any code; store models with skidyn.save_model"
        ) from error
    if size > MAX_BYTES:
        raise SkidynError(f"{source}: unpacks to {size} bytes, more than {MAX_BYTES}")
    allowed = set(trusted)
    try:
        named = skops.get_untrusted_types(file=source)
        foreign = [n for n in named if n.partition(".")[0] != "skidyn" and n not in allowed]
        if not foreign:
            return skops.load(source, trusted=named)
    except Exception as error:  # damaged files raise whatever their content leads to
        raise SkidynError(f"{source}: cannot be loaded: {error}") from error
    raise SkidynError(
        f"{source}: holds types that are not trusted: {', '.join(sorted(foreign))}. If you know "
        "where the file comes from, name them in trusted="
    )
