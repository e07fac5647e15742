# SPDX-License-Identifier: BSD-3-Clause
"""A model as a graph of ONNX operators."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from skidyn._optional import import_optional
from skidyn.dynamics import operands
from skidyn.export._files import PathLike, write_files
from skidyn.export._model import StaticModel, static_model
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

if TYPE_CHECKING:
    import onnx

#: The oldest versions with all operators in double precision; newer runtimes read them too.
OPSET, IR_VERSION = 17, 8


def to_onnx(model: RBDRegressor | Robot) -> onnx.ModelProto:
    """The model as an ONNX graph in double precision.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot for the rigid bodies of its description.

    Returns
    -------
    onnx.ModelProto
        Inputs ``q``, ``dq``, ``ddq`` and output ``tau`` of shape (n_samples, n_joints), float64, in
        rad, rad/s, rad/s^2 and N m (m and N for sliding joints); any number of samples. Its
        metadata contains ``joints`` and, as ``not_held``, the omitted effects.

    Raises
    ------
    ImportError
        onnx is not installed (``skidyn[export]``).
    SkidynError
        The model is not fitted.

    References
    ----------
    ONNX operator schemas, https://onnx.ai/onnx/operators.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import to_onnx
    >>> graph = to_onnx(load_planar_arm()).graph  # doctest: +SKIP
    >>> [x.name for x in graph.input], [x.name for x in graph.output]  # doctest: +SKIP
    (['q', 'dq', 'ddq'], ['tau'])
    """
    proto: onnx.ModelProto = _proto(static_model(model))
    return proto


def write_onnx(model: RBDRegressor | Robot, path: PathLike) -> tuple[str, ...]:
    """Write the graph of :func:`to_onnx`, and omitted effects to ``<path>.skidyn.json``.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot for the rigid bodies of its description.
    path : path
        File to write.

    Returns
    -------
    tuple of str
        Names of the effects that the file cannot represent; empty if there are none.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import write_onnx
    >>> write_onnx(load_planar_arm(), "arm.onnx")  # doctest: +SKIP
    ()
    """
    static = static_model(model)
    return write_files(path, _proto(static).SerializeToString(), model, static.left)


def _proto(static: StaticModel) -> Any:
    """The graph; every value is a column of shape (n_samples, 1)."""
    onnx = import_optional("onnx", extra="export")
    helper, double = onnx.helper, onnx.TensorProto.DOUBLE
    robot, n = static.robot, static.robot.n_joints
    signals = {x: [f"{x}_{i}" for i in range(n)] for x in ("q", "dq", "ddq")}
    nodes = [helper.make_node("Split", [x], names, axis=1) for x, names in signals.items()]
    nodes.append(helper.make_node("Sub", ["q_0", "q_0"], ["zero"]))
    constants: list[Any] = []
    names: dict[int, str] = {}
    for index in static.program.tape.live(static.program.outputs.values()):
        node = static.program.tape.nodes[index]
        names[index] = f"{node[1]}_{node[2]}" if node[0] == "input" else f"v{index}"
        if node[0] == "constant":
            constants.append(helper.make_tensor(names[index], double, [1], [node[1]]))
        elif node[0] != "input":
            terms = [names[i] for i in operands(node)]
            # ONNX has an operator of the same name for each operation of a tape
            nodes.append(helper.make_node(node[0].capitalize(), terms, [names[index]]))
    for (j,), scalar in static.program.outputs.items():
        # a torque that does not depend on the motion still has one value for each sample
        nodes.append(helper.make_node("Add", ["zero", names[scalar.index]], [f"tau_{j}"]))
    nodes.append(helper.make_node("Concat", [f"tau_{j}" for j in range(n)], ["tau"], axis=1))
    shaped = {
        x: helper.make_tensor_value_info(x, double, ["n_samples", n]) for x in (*signals, "tau")
    }
    graph = helper.make_graph(
        nodes,
        "inverse_dynamics",
        [shaped[x] for x in signals],
        [shaped["tau"]],
        constants,
        doc_string=f"Joint torques of a model of {robot.name}: {static.title}. Written by skidyn.",
    )
    versions = [helper.make_opsetid("", OPSET)]
    proto = helper.make_model(graph, opset_imports=versions, ir_version=IR_VERSION)
    helper.set_model_props(
        proto,
        {
            "joints": json.dumps(robot.joint_names),
            "not_held": json.dumps(static.left_names),
        },
    )
    onnx.checker.check_model(proto, full_check=True)
    return proto
