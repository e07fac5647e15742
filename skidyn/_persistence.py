# SPDX-License-Identifier: BSD-3-Clause
"""Models on disk without pickle: no incomplete files, and no foreign code on loading.

A skops file is a tree of nodes, each with a loader and a type. skops checks the types against one
list, independent of the loader; here every pair of loader and type has to be known, so that a file
cannot have anything called with arguments of its choice.
"""

from __future__ import annotations

import importlib
import inspect
import io
import json
import os
import zipfile
from collections.abc import Iterable, Iterator
from copy import copy, deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._optional import import_optional
from skidyn._writing import write_bytes

#: Largest unpacked size of a model file, in bytes: its arrays, counted at each reference, and its
#: description, which takes some 20 times as much memory when it is read.
MAX_BYTES, MAX_DESCRIPTION = 4 * 2**30, 128 * 2**20

#: Protocol of the skops files that are read; older ones hold nodes of other forms.
PROTOCOL = 2

#: Classes of skidyn that a stored model may contain. Functions are never trusted.
CLASSES = frozenset(
    f"skidyn.{name}"
    for name in (
        "_columns.Columns",
        "committee._elm.ELMCommittee",
        "diagnosis._correction.CorrectedRegressor",
        "diagnosis._effect_search.EffectSearchCV",
        "diagnosis._faded.FadingCorrection",
        "diagnosis._rule.Settings",
        "dynamics._tree.KinematicTree",
        "effects._term.Term",
        "effects._transformer.FrictionTransformer",
        "forecasting._forecast.AutoregressiveRegressor",
        "forecasting._forecast.PersistenceRegressor",
        "hybrid._hybrid.HybridRegressor",
        "hybrid._own_joint.OwnJointRegressor",
        "identification._constraints.BodyConstraints",
        "identification._rbd_regressor.RBDRegressor",
        "identification._uncertainty.PredictionBands",
        "model_selection._split.PhaseKFold",
        "model_selection._split.TrajectoryKFold",
        "neural_network._bll.BLLRegressor",
        "neural_network._lstm.LSTMRegressor",
        "neural_network._lstm.NDLRegressor",
        "neural_network._sdl.SDLRegressor",
        "preprocessing._current.CurrentToTorque",
        "preprocessing._derivatives.SmoothDerivatives",
        "preprocessing._signals.ButterworthFilter",
        "preprocessing._drop_keys.DropKeys",
        "preprocessing._signals.SignalScaler",
        "preprocessing._signals.TimeDerivative",
        "robots._assembly.LinkPlacement",
        "robots._robot.Robot",
    )
)

_NUMBERS = frozenset(
    f"numpy.{kind}{bits}"
    for kind, sizes in {"float": (32, 64), "int": (8, 16, 32, 64), "uint": (8, 16, 32, 64)}.items()
    for bits in sizes
)
#: Loaders of skops that only assemble data, and the types that each may make.
_DATA = {
    "BytesNode": frozenset({"builtins.bytes"}),
    "DictNode": frozenset({"builtins.dict", "collections.OrderedDict"}),
    "JsonNode": frozenset({"builtins.str"}),
    "ListNode": frozenset({"builtins.list"}),
    "NdArrayNode": _NUMBERS | {"numpy.ndarray", "numpy.bool", "numpy.str_"},
    "SetNode": frozenset({"builtins.set"}),
    "SliceNode": frozenset({"builtins.slice"}),
    "TupleNode": frozenset({"builtins.tuple"}),
    "TypeNode": frozenset(f"builtins.{name}" for name in ("bool", "float", "int", "str"))
    | _NUMBERS,
}
#: Parts of scikit-learn's gradient boosting, which skops does not know: arrays with a class.
PARTS = frozenset(
    {
        "sklearn._loss._loss.CyHalfSquaredError",
        "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
    }
)
#: Random generators, which are never loaded.
GENERATOR = "numpy.random._generator.Generator"
#: Loaders that make an object from a state or from arguments. They are permitted only for classes:
#: those of skidyn and scikit-learn by their state, and the user's own, which may need arguments.
_FROM_STATE = "ObjectNode"
_FROM_ARGUMENTS = frozenset(
    {"ConstructorFromReduceNode", "LossNode", "RandomStateNode", "SparseMatrixNode", "TreeNode"}
)


def save_model(path: Any, model: Any) -> Path:
    """Store a fitted model with skops, in one step.

    The order of ``joblib.dump`` and ``skops.io.dump``, ``save_model(model, path)``, means the same.

    Parameters
    ----------
    path : path
        File to write, for example ``model.skops``; it is replaced in one step, so that the old file
        remains after an error.
    model : estimator
        Any estimator of skidyn, or of scikit-learn with estimators of skidyn inside.

    Returns
    -------
    path : Path
        The file.

    Raises
    ------
    SkidynError
        There is no path or no model; or the model contains a function, or another object that
        :func:`load_model` never creates.

    Notes
    -----
    A :class:`skidyn.diagnosis.EffectSearchCV` is stored without its ``diagnosis_``, which holds the
    log, and its ``scorer_``; fitted inside another estimator it cannot be stored.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from sklearn.linear_model import Ridge
    >>> from skidyn import load_model, save_model
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_model(save_model(pathlib.Path(folder, "model.skops"), Ridge(alpha=2.0)))
    Ridge(alpha=2.0)
    """
    if isinstance(model, str | os.PathLike) and not isinstance(path, str | os.PathLike):
        path, model = model, path
    if not isinstance(path, str | os.PathLike) or isinstance(model, str | os.PathLike):
        raise SkidynError(
            f"save_model takes a path and a model; got a {type(path).__name__} and a "
            f"{type(model).__name__}"
        )
    skops = import_optional("skops.io", extra="share")
    target = Path(path)
    if hasattr(model, "diagnosis_"):
        model = copy(model)
        del model.diagnosis_, model.scorer_
    data, lost = _stored(skops, model, target)
    if GENERATOR in lost:  # gradient boosting keeps that of its fit, which it does not need again
        data, lost = _stored(skops, _without_generators(deepcopy(model)), target)
    if lost:
        raise SkidynError(
            f"{type(model).__name__} cannot be stored: it holds {', '.join(sorted(lost))}, but "
            "only data and classes can be loaded again. Use a class with this method "
            f"instead.{_instead(model)}"
        )
    return write_bytes(target, data)


def _stored(skops: Any, model: Any, target: Path) -> tuple[bytes, set[str]]:
    """A model in the format of skops, and what it holds that is never loaded again."""
    try:
        data = skops.dumps(model)
    except Exception as error:  # any error of an object without an accessible state
        raise SkidynError(
            f"{type(model).__name__} cannot be stored: {error}.{_instead(model)}"
        ) from error
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        nodes = list(_nodes(_description(archive, target)))
    return data, {name for loader, name in nodes if loader not in _LOADERS}


def _without_generators(model: Any) -> Any:
    """The model, whose fitted gradient boosting has lost its random generators."""
    stack, seen = [model], set()
    while stack:
        part = stack.pop()
        if id(part) in seen:
            continue
        seen.add(id(part))
        if isinstance(part, list | tuple):
            stack.extend(part)
        elif isinstance(part, dict):
            stack.extend(part.values())
        elif hasattr(part, "get_params"):
            own = vars(part)
            if type(part).__module__.startswith("sklearn.ensemble._hist_gradient_boosting"):
                for name in [k for k, v in own.items() if isinstance(v, np.random.Generator)]:
                    del own[name]
            stack.extend(own.values())
    return model


def _instead(model: Any) -> str:
    """The part of a search that can be stored."""
    found = hasattr(model, "best_estimator_")
    return " Store its best_estimator_ instead." if found else ""


def load_model(path: str | os.PathLike[str], *, trusted: Iterable[str] = ()) -> Any:
    """Load a model that :func:`save_model` stored.

    Nothing in the file is called, and no module is imported for it, unless its name is on a list:
    the estimators of skidyn and the classes in them, the estimators of scikit-learn that skops
    trusts, and the names in ``trusted``.

    Parameters
    ----------
    path : path
        File.
    trusted : iterable of str, default=()
        Further classes that may be created, by their full names, such as
        ``"my_package.MyRegressor"``. They run their own code, so list only classes that you know.

    Returns
    -------
    estimator
        The model.

    Raises
    ------
    SkidynError
        The file is a pickle or damaged, unpacks to more than 4 GiB, or contains anything other than
        data and the classes of the list; or a name in ``trusted`` is not a class.

    Examples
    --------
    >>> from skidyn import load_model
    >>> load_model("model.skops").predict(X)  # doctest: +SKIP
    """
    skops = import_optional("skops.io", extra="share")
    source, own = Path(path), frozenset(trusted)
    for name in own:
        _check_class(name)
    with source.open("rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                nodes = set(_nodes(_description(archive, source)))
        except SkidynError:
            raise
        except zipfile.BadZipFile as error:
            raise SkidynError(
                f"{source}: not a skops file. Pickles and joblib files are refused because "
                "loading one can run arbitrary code; store models with skidyn.save_model"
            ) from error
        except Exception as error:  # damaged archives may raise any exception
            raise SkidynError(f"{source}: cannot be loaded: {error}") from error
    foreign = sorted({name for loader, name in nodes if not _is_known(loader, name, own)})
    if not foreign:
        named = sorted({name for _, name in nodes if name in CLASSES or name in PARTS} | own)
        try:
            foreign = sorted(set(skops.get_untrusted_types(file=source)) - set(named))
            if not foreign:
                return skops.load(source, trusted=named)
        except Exception as error:  # damaged files may raise any exception
            raise SkidynError(f"{source}: cannot be loaded: {error}") from error
    raise SkidynError(
        f"{source}: holds untrusted types: {', '.join(foreign)}. Functions are never loaded; if "
        "these are classes and you trust the source of the file, list them in trusted="
    )


_LOADERS = frozenset(_DATA) | _FROM_ARGUMENTS | {_FROM_STATE}


def _is_known(loader: str, name: str, trusted: frozenset[str]) -> bool:
    """Whether a node may be created; skops checks scikit-learn's classes later."""
    if loader in _DATA:
        return name in _DATA[loader] or (loader == "TypeNode" and name in CLASSES | trusted)
    if loader == "LossNode":  # made without arguments
        return name in PARTS or name in trusted
    if loader == _FROM_STATE:
        return name in CLASSES or name in trusted or name.startswith("sklearn.")
    return loader in _FROM_ARGUMENTS and name in trusted


def _description(archive: zipfile.ZipFile, source: Path) -> dict[str, Any]:
    """Description of the parts of a model, with a bound before anything is unpacked."""
    sizes = {member.filename: member.file_size for member in archive.infolist()}
    if max(sum(sizes.values()), sizes["schema.json"] * MAX_BYTES // MAX_DESCRIPTION) > MAX_BYTES:
        raise SkidynError(
            f"{source}: unpacks to {sum(sizes.values())} bytes, more than {MAX_BYTES}, or has a "
            f"description of more than {MAX_DESCRIPTION}"
        )
    description: dict[str, Any] = json.loads(archive.read("schema.json"))
    if description.get("protocol") != PROTOCOL:
        raise SkidynError(
            f"{source}: cannot be loaded: it has protocol {description.get('protocol')!r} of "
            f"skops, not {PROTOCOL}; store the model again with skidyn.save_model"
        )
    # Each node with a file reads it again.
    named = sum(sizes.get(node["file"], 0) for node in _dictionaries(description) if "file" in node)
    if named > MAX_BYTES:
        raise SkidynError(f"{source}: unpacks to {named} bytes, more than {MAX_BYTES}")
    return description


def _nodes(description: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Loader and full name of everything that a file would create."""
    for node in _dictionaries(description):
        if "__loader__" in node:
            yield str(node["__loader__"]), f"{node['__module__']}.{node['__class__']}"


def _dictionaries(content: Any) -> Iterator[dict[str, Any]]:
    """Every dictionary of a description, without recursion, since files may be nested deeply."""
    stack = [content]
    while stack:
        part = stack.pop()
        if isinstance(part, dict):
            yield part
            stack.extend(part.values())
        elif isinstance(part, list):
            stack.extend(part)


def _check_class(name: str) -> None:
    """Check that a name trusted by the user is a class."""
    module, _, last = name.rpartition(".")
    try:
        found = getattr(importlib.import_module(module), last)
    except (ImportError, AttributeError, ValueError) as error:
        raise SkidynError(f"trusted names {name!r}, which cannot be imported: {error}") from error
    if not inspect.isclass(found):
        raise SkidynError(
            f"trusted names {name!r}, which is not a class; functions are never loaded"
        )
