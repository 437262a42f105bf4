"""Reads a table with pandas, polars and pyarrow; prints rows, columns and one number that each of them read."""
import sys

import pandas
import polars
import pyarrow.csv

path, column = sys.argv[1], sys.argv[2]
frames = {
    "pandas": pandas.read_csv(path, float_precision="round_trip"),
    "polars": polars.read_csv(path, infer_schema_length=None),
    "pyarrow": pyarrow.csv.read_csv(path),
}
for name, frame in frames.items():
    value = frame[column][len(frame) - 1]
    value = value.as_py() if hasattr(value, "as_py") else float(value)
    print(name, len(frame), frame.shape[1], value.hex())
