# SPDX-License-Identifier: BSD-3-Clause
"""Models on disk: what is stored comes back, and files that could run code are refused."""

import importlib
import inspect
import json
import os
import pickle
import pkgutil
import random
import sys
import zipfile
from contextlib import contextmanager

import numpy as np
import pytest
from sklearn.base import BaseEstimator
from sklearn.linear_model import Ridge
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

import skidyn
from skidyn.committee import ELMCommittee
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import EffectSearchCV, Settings
from skidyn.exceptions import SkidynError
from skidyn.hybrid import HybridRegressor, OwnJointRegressor
from skidyn.identification import RBDRegressor
from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor, SDLRegressor
from skidyn.preprocessing import SmoothDerivatives

pytest.importorskip("skops.io")


class Foreign(BaseEstimator):
    """A type from elsewhere."""


def test_a_fitted_model_comes_back(tmp_path):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=4.0)
    model = RBDRegressor(log.robot).fit(log.X, log.y)
    again = skidyn.load_model(skidyn.save_model(tmp_path / "m.skops", model))
    np.testing.assert_array_equal(again.predict(log.X), model.predict(log.X))


def learners(robot):
    """One of each, small."""
    small = {"window": 4, "hidden_size": 4, "max_epochs": 1, "random_state": 0}
    lstm = LSTMRegressor(**small)
    physics = RBDRegressor(robot)
    return [
        NDLRegressor(**small),
        SDLRegressor(robot, **small),
        BLLRegressor(lstm, n_estimators=2, random_state=0),
        ELMCommittee(2, n_hidden=10, random_state=0),
        HybridRegressor(physics, lstm, cv=2, alpha=1.0),
        HybridRegressor(physics, cv=2, alpha=1.0),
        OwnJointRegressor(),
    ]


@pytest.mark.parametrize("number", range(7))
def test_every_learner_comes_back(tmp_path, number):
    log = make_hidden_effect_log(
        load_planar_arm(), "spring", n_trajectories=4, duration=3.0, rate=25.0
    )
    model = learners(log.robot)[number].fit(log.X, log.y)
    again = skidyn.load_model(skidyn.save_model(tmp_path / "m.skops", model))
    np.testing.assert_array_equal(again.predict(log.X), model.predict(log.X))
    with zipfile.ZipFile(tmp_path / "m.skops") as archive:  # arrays and a description, no pickles
        kinds = {name.rpartition(".")[2] for name in archive.namelist()}
    assert kinds <= {"npy", "json"}


def test_path_and_model_in_either_order(tmp_path):
    path = tmp_path / "m.skops"
    assert skidyn.save_model(Ridge(alpha=2.0), path) == skidyn.save_model(path, Ridge(alpha=2.0))
    assert skidyn.load_model(path).alpha == 2.0
    for pair in ((Ridge(), Ridge()), (path, path)):
        with pytest.raises(SkidynError, match="takes a path and a model"):
            skidyn.save_model(*pair)


def test_pickles_are_refused_and_never_run(tmp_path):
    class Attack:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "harm"),)

    (tmp_path / "m.pkl").write_bytes(pickle.dumps(Attack()))
    with pytest.raises(SkidynError, match="Pickles and joblib files are refused"):
        skidyn.load_model(tmp_path / "m.pkl")
    assert not (tmp_path / "harm").exists()


def test_foreign_types_need_to_be_named(tmp_path):
    file = skidyn.save_model(tmp_path / "m.skops", Foreign())
    with pytest.raises(SkidynError, match=r"untrusted types: .*Foreign"):
        skidyn.load_model(file)


def test_damaged_files_are_told(tmp_path):
    with zipfile.ZipFile(tmp_path / "m.skops", "w") as archive:
        archive.writestr("schema.json", "{}")
    with pytest.raises(SkidynError, match="cannot be loaded"):
        skidyn.load_model(tmp_path / "m.skops")


@pytest.mark.parametrize(
    ("at", "value"),
    [(6, b"\xff"), (10, b"\x63"), (8, b"\x01"), (42, b"\xff\xff\xff\x7f")],
    ids=["version", "compression", "encryption", "offset"],
)
def test_damaged_archives_are_told(tmp_path, at, value):
    """What fuzzing found: each of these is an error of another type to the archive's reader."""
    file, _ = stored(tmp_path)
    data = bytearray(file.read_bytes())
    entry = data.rindex(b"PK\x01\x02")  # of schema.json, the last in the list of contents
    data[entry + at : entry + at + len(value)] = value
    file.write_bytes(data)
    with pytest.raises(SkidynError, match=r"m\.skops: (cannot be loaded|not a skops file)"):
        skidyn.load_model(file)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="none.skops"):
        skidyn.load_model(tmp_path / "none.skops")


def test_a_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("skidyn._persistence.MAX_BYTES", 1_000_000)
    with zipfile.ZipFile(tmp_path / "m.skops", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("schema.json", b" " * 5_000_000)
    with pytest.raises(SkidynError, match="unpacks to"):
        skidyn.load_model(tmp_path / "m.skops")


# ------------------------------------------------------------------ crafted files
def stored(tmp_path):
    """A file of a genuine model, and its description."""
    model = make_pipeline(SmoothDerivatives(), RBDRegressor(load_planar_arm()))
    file = skidyn.save_model(tmp_path / "m.skops", model)
    with zipfile.ZipFile(file) as archive:
        return file, {name: archive.read(name) for name in archive.namelist()}


def craft(path, description, members=None):
    """Write a model file with a description of one's own."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in (members or {}).items():
            if name != "schema.json":
                archive.writestr(name, content)
        archive.writestr("schema.json", json.dumps({"protocol": 2, **description}))
    return path


def node(loader, name, content=None, **more):
    module, _, last = name.rpartition(".")
    return {"__loader__": loader, "__module__": module, "__class__": last, "content": content,
            **more}  # fmt: skip


def text(value):
    return node("JsonNode", "builtins.str", json.dumps(value))


def arguments(*values):
    return node("TupleNode", "builtins.tuple", [text(value) for value in values])


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("skidyn._writing.write_text", ["{harm}", "harm"]),
        ("skidyn._writing.write_json", ["{harm}", {}]),
        ("skidyn.dynamics._compiled.compile_library", ["void f(void) {{}}"]),
        ("skidyn.robots._robot.Robot", ["{harm}"]),
        ("pathlib.Path", ["{harm}"]),
        ("builtins.open", ["{harm}", "w"]),
    ],
)
@pytest.mark.parametrize("trusted", [False, True])
def test_a_function_or_constructor_that_a_file_names_is_not_called(tmp_path, name, values, trusted):
    harm = tmp_path / "harm"
    told = [v.format(harm=harm) if isinstance(v, str) else v for v in values]
    crafted = node("ConstructorFromReduceNode", name, arguments(*told))
    file = craft(tmp_path / "m.skops", crafted)
    if trusted and inspect.isclass(find(name)):
        return  # the user vouches for the class
    with pytest.raises(SkidynError, match=name if not trusted else "not a class"):
        skidyn.load_model(file, trusted=[name] if trusted else ())
    assert not harm.exists()


def find(name):
    module, _, last = name.rpartition(".")
    return getattr(importlib.import_module(module), last)


def callables_of_skidyn():
    """Names of all functions and classes, in every module."""
    names = []
    for module in pkgutil.walk_packages(skidyn.__path__, "skidyn."):
        if module.name.endswith("__main__"):
            continue
        content = importlib.import_module(module.name)
        for name, value in vars(content).items():
            if callable(value) and getattr(value, "__module__", "") == module.name:
                names.append(f"{module.name}.{name}")
    return names


@pytest.fixture(scope="module")
def trusted(tmp_path_factory):
    """Names of skidyn that a file may contain: a file that contains only the name is loaded."""
    path, found = tmp_path_factory.mktemp("named") / "named.skops", set()
    for name in callables_of_skidyn():
        try:
            assert skidyn.load_model(craft(path, node("TypeNode", name))) is find(name)
            found.add(name)
        except SkidynError as error:
            assert name in str(error)
    return found


def test_what_is_trusted_are_classes_and_no_function(trusted):
    assert trusted and all(inspect.isclass(find(name)) for name in trusted)


def test_every_estimator_of_skidyn_is_trusted(trusted):
    estimators = set()
    for module in pkgutil.iter_modules(skidyn.__path__, "skidyn."):
        if module.ispkg and not module.name.rpartition(".")[2].startswith("_"):
            package = importlib.import_module(module.name)
            public = [getattr(package, name) for name in getattr(package, "__all__", ())]
            estimators |= {c for c in public if inspect.isclass(c) and issubclass(c, BaseEstimator)}
    assert len(estimators) > 10
    assert {f"{c.__module__}.{c.__qualname__}" for c in estimators} <= trusted


def test_a_model_with_a_function_inside_is_refused_when_it_is_stored(tmp_path):
    model = make_pipeline(FunctionTransformer(np.log1p), KNeighborsRegressor())
    with pytest.raises(SkidynError, match="log1p"):
        skidyn.save_model(tmp_path / "m.skops", model)
    assert not list(tmp_path.iterdir())


def test_a_search_is_stored_without_its_diagnosis(tmp_path):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=3.0)
    settings = Settings(max_findings=2)
    search = EffectSearchCV(RBDRegressor(log.robot), effects=("spring",), cv=2, settings=settings)
    again = skidyn.load_model(skidyn.save_model(tmp_path / "before.skops", search))
    assert again.settings == settings
    search.fit(log.X, log.y)
    again = skidyn.load_model(skidyn.save_model(tmp_path / "m.skops", search))
    np.testing.assert_array_equal(again.predict(log.X), search.predict(log.X))
    assert again.best_score_ == search.best_score_
    assert hasattr(search, "diagnosis_") and not hasattr(again, "diagnosis_")
    with pytest.raises(SkidynError, match="Pipeline cannot be stored"):
        skidyn.save_model(tmp_path / "pipeline.skops", make_pipeline(search))
    assert not (tmp_path / "pipeline.skops").exists()


def test_one_large_array_named_again_and_again_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("skidyn._persistence.MAX_BYTES", 1_000_000)
    array = node("NdArrayNode", "numpy.ndarray", type="numpy", file="a.npy")
    crafted = node("ListNode", "builtins.list", [array] * 20)
    with pytest.raises(SkidynError, match="unpacks to 2000000 bytes"):
        skidyn.load_model(craft(tmp_path / "m.skops", crafted, {"a.npy": b" " * 100_000}))


@contextmanager
def watched(entered):
    """Note every function that is entered, and what an audit hook hears of the system."""

    def profile(frame, event, argument):
        if event == "call":
            entered.add((frame.f_globals.get("__name__", ""), frame.f_code.co_qualname))
        elif event == "c_call":
            module = getattr(argument, "__module__", None) or ""
            entered.add((module, getattr(argument, "__qualname__", "")))

    _HEARD.append(entered)
    sys.setprofile(profile)
    try:
        yield
    finally:
        sys.setprofile(None)
        _HEARD.remove(entered)


_HEARD: list[set[tuple[str, str]]] = []
_EVENTS = ("os.", "subprocess.", "ctypes.", "socket.", "shutil.", "exec", "compile", "open")


def _audit(event, arguments):
    for heard in _HEARD:
        if event.startswith(_EVENTS):
            written = event == "open" and (arguments[1] or "r") not in ("r", "rb")
            heard.add(("audit", "written" if written else event))


sys.addaudithook(_audit)  # cannot be removed, so it is silent without a listener

#: Callables that a crafted file may want to reach, besides all of skidyn.
DANGEROUS = (
    "os.system", "os.remove", "os.mkdir", "subprocess.run", "builtins.eval", "builtins.exec",
    "builtins.open", "builtins.getattr", "builtins.__import__", "importlib.import_module",
    "pickle.loads", "ctypes.CDLL", "shutil.rmtree", "pathlib.Path", "functools.partial",
    "operator.methodcaller", "numpy.load", "numpy.fromfile", "numpy.void", "numpy.seterrcall",
    "joblib.load", "sklearn.datasets.fetch_openml", "sklearn.utils.all_estimators",
    "skops.io.load", "skidyn.__main__.main", "urllib.request.urlopen", "logging.FileHandler",
)  # fmt: skip
LOADERS = (
    "ConstructorFromReduceNode", "ObjectNode", "FunctionNode", "TypeNode", "PartialNode",
    "MethodNode", "OperatorFuncNode", "DefaultDictNode", "DictNode", "ListNode", "TupleNode",
    "SetNode", "NdArrayNode", "MaskedArrayNode", "DTypeNode", "RandomStateNode", "SliceNode",
    "RandomGeneratorNode", "SparseMatrixNode", "TreeNode", "LossNode", "BytesNode", "CachedNode",
    "JsonNode", "NoNode",
)  # fmt: skip


def crafted_nodes(rng, names, trusted):
    """A node that names what it must not, in one of the ways that skops knows."""
    name, loader = rng.choice(names), rng.choice(LOADERS)
    values = arguments(*rng.choices(["harm", "rm", 1, [], {}, "q1"], k=rng.randrange(3)))
    empty = node("DictNode", "builtins.dict", {})
    content = rng.choice([
        values,
        [text("harm")],
        {"a": text("harm")},
        {"func": node("FunctionNode", name), "args": values, "kwds": empty, "namespace": empty},
        {"func": name.rpartition(".")[2], "obj": node("ObjectNode", rng.choice(trusted))},
        {"bit_generator": empty | {"content": {"bit_generator": text(name)}}, "seed_seq": values},
        {"main": text({}), "default_factory": node("TypeNode", name)},
        {"module_path": name.rpartition(".")[0], "function": name.rpartition(".")[2]},
        json.dumps("harm"),
        None,
    ])  # fmt: skip
    keys = node("ListNode", "builtins.list", [node("TypeNode", rng.choice([name, "builtins.str"]))])
    more = {"key_types": keys, "attrs": values, "file": "schema.json", "type": "numpy"}
    more["__reduce__"] = {"args": values}
    return node(loader, name, content, **more)


def places(part, found):
    """Every node of a description, with where it hangs."""
    for key, value in part.items() if isinstance(part, dict) else enumerate(part):
        if isinstance(value, dict) and "__loader__" in value:
            found.append((part, key))
        if isinstance(value, (dict, list)):
            places(value, found)
    return found


def test_no_callable_outside_the_list_is_ever_entered(tmp_path, trusted):
    """Crafted nodes in place of a node of a genuine file; the loader is watched from outside."""
    genuine, members = stored(tmp_path)
    skidyn.load_model(genuine)  # what is imported once is imported
    usual: set[tuple[str, str]] = set()
    with watched(usual):
        skidyn.load_model(genuine)
    rng = random.Random(16)
    names = [*DANGEROUS, *(n for n in callables_of_skidyn() if n not in trusted)]
    assert len(names) > 500
    own = {"skidyn", "skidyn._persistence", "skidyn.exceptions", "skidyn._optional"}
    allowed = {name.rpartition(".")[0] for name in trusted}
    entered: set[tuple[str, str]] = set()
    refused = 0
    for k in range(300):
        description = json.loads(members["schema.json"])
        part, key = rng.choice(places(description, []))
        part[key] = crafted_nodes(rng, names, sorted(trusted))
        if k % 7 == 0:
            description["protocol"] = rng.randrange(3)
        if k % 11 == 0:  # nothing around it
            description = {**part[key], "protocol": 2}
        file = craft(tmp_path / "crafted.skops", description, members)
        with watched(entered):
            try:
                skidyn.load_model(file)
            except SkidynError:
                refused += 1
    assert refused > 250  # the others put something harmless into a place that is never looked at
    ran = {(module, name) for module, name in entered if module.partition(".")[0] == "skidyn"}
    assert ran
    for module, name in ran - {(m, n) for m, n in ran if m in own}:
        assert module in allowed and name.endswith(("__setstate__", "__init__", "__post_init__"))
    heard = {name for module, name in entered if module == "audit"}
    assert heard <= {"open", "os.putenv"}
    reached = {f"{module}.{name}" for module, name in entered - usual}
    assert not reached & set(names)
