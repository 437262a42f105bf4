"""Reads a table with pandas, polars and pyarrow; prints rows, columns and one number that each of them read."""
import sys

import pandas
import polars
import pyarrow.parquet

path, column = sys.argv[1], sys.argv[2]
frames = {
    "pandas": pandas.read_parquet(path),
    "polars": polars.read_parquet(path),
    "pyarrow": pyarrow.parquet.read_table(path),
}
for name, frame in frames.items():
    value = frame[column][len(frame) - 1]
    value = value.as_py() if hasattr(value, "as_py") else float(value)
    print(name, len(frame), frame.shape[1], value.hex())
