# SPDX-License-Identifier: BSD-3-Clause
"""Reader of Parquet and Feather tables, a bounded number of values at a time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._checks import refuse_duplicates
from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn.logs._bounds import Budget, check_size, try_in_another_process
from skidyn.logs._files import Channel, stack_rows, table_from_arrays

#: Types that are read as a dictionary with indices, since a text may be repeated many times.
_TEXT = ("string", "large_string", "binary", "large_binary", "dictionary")
_OTHER_TEXT = ("string_view", "binary_view", "fixed_size_binary")
#: Values that are decoded at once.
_AT_ONCE = 2**22
#: Bytes of one value in memory, by the type it is stored as; text is kept once and numbered.
_WIDTH = {"INT96": 12}
_LEAST_WIDTH = 8
#: Bytes that an object of Python takes beside its content, text or an array.
_OBJECT = 112
#: Name of the index column of pandas, which is not a column of the log.
_INDEX = "__index_level_"


def read_parquet_channels(path: Path, max_bytes: int) -> list[Channel]:
    """Read a Parquet or Feather table; list columns become one column per joint."""
    arrow = import_optional("pyarrow", extra="io")
    try:
        batches = _parquet_batches if path.suffix.lower() == ".parquet" else _feather_batches
        columns = _joined(batches(path, max_bytes), Budget(path, max_bytes))
    except arrow.ArrowException as error:
        raise LogError(f"{path}: cannot be read as a table: {error}") from error
    blocks: dict[str, Any] = {}
    for name, values in columns.items():
        lists = values.dtype == object and len(values) and np.ndim(values[0]) == 1
        blocks[name] = stack_rows(list(values), name, str(path)) if lists else values
    return [Channel(path.name, table_from_arrays(blocks))]


def check_parquet_size(path: Path, metadata: Any, max_bytes: int) -> int:
    """Refuse a file that decodes to too much; returns the most values that a row may have.

    The stored size of a column is no bound: a page may refer to one value of a dictionary a million
    times.
    """
    size = values = 0
    for k in range(metadata.num_row_groups):
        group = metadata.row_group(k)
        rows = max(1, group.num_rows)
        for i in range(group.num_columns):
            column = group.column(i)
            width = max(_LEAST_WIDTH, _WIDTH.get(column.physical_type, 0))
            if column.physical_type == "FIXED_LEN_BYTE_ARRAY":
                width = max(width, int(metadata.schema.column(i).length))
            size += max(column.num_values * width, column.total_uncompressed_size)
            values = max(values, -(-column.num_values // rows))
    check_size(path, size, max_bytes)
    return max(1, values)


def _parquet_batches(path: Path, max_bytes: int) -> Iterator[Any]:
    parquet = import_optional("pyarrow.parquet", extra="io")
    types = import_optional("pyarrow.types", extra="io")
    with parquet.ParquetFile(path) as plain:
        schema = plain.schema_arrow
        refuse_duplicates(schema.names, str(path))
        per_row = check_parquet_size(path, plain.metadata, max_bytes)
        texts = [getattr(types, f"is_{kind}") for kind in _TEXT]
        text = [field.name for field in schema if any(test(field.type) for test in texts)]
    with parquet.ParquetFile(path, read_dictionary=text) as file:
        yield file.schema_arrow
        rows = max(1, min(65_536, _AT_ONCE // (per_row * max(1, len(schema.names)))))
        yield from file.iter_batches(rows, use_threads=False)


def _feather_batches(path: Path, max_bytes: int) -> Iterator[Any]:
    feather = import_optional("pyarrow.feather", extra="io")
    check_size(path, path.stat().st_size, max_bytes)
    try_in_another_process(
        path,
        max_bytes,
        "from pyarrow import feather",
        "feather.read_table(sys.argv[1], use_threads=False)",
    )
    table = feather.read_table(path)
    refuse_duplicates(table.column_names, str(path))
    yield table.schema
    yield from table.to_batches()


def _joined(batches: Iterator[Any], budget: Budget) -> dict[str, np.ndarray]:
    """Columns as arrays; the schema comes first, then the batches."""
    schema = next(batches)
    names = [name for name in schema.names if not name.startswith(_INDEX)]
    parts: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for batch in batches:
        for name in names:
            column = batch.column(name)
            budget.take(_decoded(column))
            parts[name].append(_array(column))
    empty = [np.empty(0)]
    return {name: np.concatenate(parts.pop(name) or empty) for name in names}


def _decoded(column: Any) -> int:
    """Bytes of a column as an array; runs and null values take no space in a file."""
    types = import_optional("pyarrow.types", extra="io")
    kind, size = column.type, _LEAST_WIDTH * len(column)
    if types.is_dictionary(kind):
        return size + _decoded(column.dictionary)
    if _is_list(kind):
        return size + _OBJECT * len(column) + _decoded(column.flatten())
    if any(getattr(types, f"is_{text}")(kind) for text in (*_TEXT, *_OTHER_TEXT)):
        return size + _OBJECT * len(column) + int(column.nbytes)
    return max(size, int(column.nbytes))


def _is_list(kind: Any) -> bool:
    types = import_optional("pyarrow.types", extra="io")
    return bool(types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind))


def _is_plain(kind: Any) -> bool:
    """Whether values of a type are single ones, without repetition or nesting."""
    types = import_optional("pyarrow.types", extra="io")
    return not (
        types.is_nested(kind) or types.is_dictionary(kind) or types.is_run_end_encoded(kind)
    )


def _array(column: Any) -> np.ndarray:
    """Values of a column: numbers, dates, times since something, or objects.

    Structures, and lists or repeated values other than numbers or text, become None: they are not
    signals, and small files can nest and repeat them without limit.
    """
    types = import_optional("pyarrow.types", extra="io")
    kind = column.type
    runs = types.is_run_end_encoded(kind)
    inner = kind.value_type if runs or types.is_dictionary(kind) or _is_list(kind) else kind
    if not _is_plain(inner) or (runs and not types.is_primitive(inner)):
        return np.full(len(column), None, dtype=object)
    if types.is_dictionary(kind):
        words = np.array([*column.dictionary.to_pylist(), None], dtype=object)
        return np.asarray(words[column.indices.fill_null(len(words) - 1).to_numpy()])
    if types.is_decimal(kind):
        return np.asarray(column.cast("float64").to_numpy(zero_copy_only=False))
    if types.is_time(kind):
        return np.asarray(
            column.cast(f"int{kind.bit_width}").to_numpy(zero_copy_only=False)
        ).astype(f"timedelta64[{kind.unit}]")
    return np.asarray(column.to_numpy(zero_copy_only=False))
