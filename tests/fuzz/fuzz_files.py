"""Valid files of every format that is read, small, from which damaged ones are made."""

from __future__ import annotations

import gzip
import io
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from measured_files import uff58, write_tdms, write_uff
from scipy.io import savemat

ROWS = 60
T = np.arange(ROWS) / 1000.0
U = np.sin(200.0 * T) + 0.1 * np.cos(3000.0 * T)
X = 0.3 * np.cos(150.0 * T)


def texts() -> list[str]:
    """Tables of text in many habits."""
    rows = list(zip(T, U, X, strict=True))
    plain = "t [s],u [V],x [mm]\n" + "".join(f"{t:.4f},{u:.6g},{x:.6g}\n" for t, u, x in rows)
    german = "Zeit;Weg;Kraft\ns;mm;N\n" + "".join(
        f"{t:.4f};{x:.6f};{u:.6f}\n".replace(".", ",") for t, u, x in rows
    )
    scope = "Model,DPO4034\nRecord Length,60\nSample Interval,1e-3,s\n\nTIME,CH1,CH2\n" + "".join(
        f"{t:.6E},{u:.6E},{x:.6E}\n" for t, u, x in rows
    )
    dated = "time\tu (V)\tx (um)\n" + "".join(
        f"2026-11-21T10:00:{t:09.6f}\t{u:.6g}\t{x:.6g}\n" for t, u, x in rows
    )
    blanks = "# t u x\n" + "".join(f"  {t:10.5f}  {u:10.5f}  {x:10.5f}\n" for t, u, x in rows)
    return [plain, german, scope, dated, blanks]


def files(folder: Path) -> dict[str, list[bytes]]:
    """Return valid files by suffix; `folder` is for writers that need one."""
    made: dict[str, list[bytes]] = {
        ".csv": [text.encode() for text in texts()] + [texts()[0].encode("utf-16"), texts()[1].encode("latin-1")],
        ".csv.gz": [gzip.compress(texts()[0].encode(), mtime=0)],
        ".npz": [_written(folder / "a.npz", lambda path: np.savez(path, t=T, u=U, x=X, fs=1000.0)),
                 _written(folder / "b.npz", lambda path: np.savez_compressed(path, u=U, x=X))],
        ".uff": [_written(folder / "a.uff", _uff(binary)) for binary in (False, True)],
        ".tdms": [_written(folder / "a.tdms", _tdms)],
    }  # fmt: skip
    table = _arrow_table()
    made[".parquet"] = [
        _written(folder / f"{kind}.parquet", lambda path, kind=kind: pq.write_table(table, path, compression=kind))
        for kind in ("NONE", "SNAPPY", "ZSTD")
    ]  # fmt: skip
    made[".arrow"] = [_arrow(table, pa.ipc.new_file), _arrow(table, pa.ipc.new_stream)]
    made[".h5"] = [_written(folder / "a.h5", _hdf5), _written(folder / "b.h5", _hdf5_chunked)]
    made[".mat"] = [
        _written(folder / "a.mat", lambda path: savemat(path, {"t": T, "u": U, "x": X, "fs": 1000.0})),
        _written(
            folder / "b.mat",
            lambda path: savemat(
                path, {"run": {"t": T, "u": U, "x": X, "name": "a"}, "c": _cell()}, do_compression=True
            ),
        ),
        _written(
            folder / "c.mat", lambda path: savemat(path, {"data": np.column_stack([T, U, X])}, format="4")
        ),
    ]
    return made


def _cell() -> np.ndarray:
    cell = np.empty(2, dtype=object)
    cell[0], cell[1] = U, "text"
    return cell


def _written(path: Path, write: Callable[[Path], None]) -> bytes:
    write(path)
    content = path.read_bytes()
    path.unlink()
    return content


def _uff(binary: bool) -> Callable[[Path], None]:
    functions = [
        uff58(U, id1="drive", unit="V", binary=binary),
        uff58(X, id1="x tip", unit="mm", binary=binary),
    ]
    return lambda path: write_uff(path, functions)


def _tdms(path: Path) -> None:
    properties = {"wf_increment": 1e-3, "unit_string": "V", "NI_Scaling_Status": "unscaled"}
    write_tdms(
        path, {"u": U, "x": (1e4 * X).astype(np.int16)}, {"u": properties, "x": properties}, segments=2
    )
    path.with_name(path.name + "_index").unlink(missing_ok=True)


def _arrow_table() -> pa.Table:
    fields = [pa.field("t", pa.float64()), pa.field("u", pa.float64(), metadata={"unit": "V"}),
              pa.field("x", pa.float32(), metadata={"units": "mm", "scale_factor": "0.5"})]  # fmt: skip
    return pa.table([pa.array(T), pa.array(U), pa.array(X.astype(np.float32))], schema=pa.schema(fields))


def _arrow(table: pa.Table, opened: Callable[..., pa.RecordBatchWriter]) -> bytes:
    sink = io.BytesIO()
    with opened(sink, table.schema) as writer:
        writer.write_table(table, max_chunksize=25)
    return sink.getvalue()


def _hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        run = file.create_group("run")
        for name, values, unit in (("t", T, "s"), ("u", U, "V"), ("x", X, "mm")):
            run[name] = values
            run[name].attrs["units"] = unit
        run["x"].attrs["scale_factor"] = np.array([0.5])
        file["alias"] = h5py.SoftLink("/run/x")


def _hdf5_chunked(path: Path) -> None:
    with h5py.File(path, "w", libver="latest") as file:
        for name, values in (("t", T), ("u", U)):
            file.create_dataset(name, data=values, chunks=(20,), compression="gzip", shuffle=True)
        file.create_dataset("x", data=(1e3 * X).astype(np.int16), chunks=(30,), fletcher32=True, fillvalue=-1)
        file["x"].attrs["_FillValue"] = np.int16(-1)
        layout = h5py.VirtualLayout(shape=(ROWS,), dtype="f8")
        layout[:] = h5py.VirtualSource(".", "u", shape=(ROWS,))
        file.create_virtual_dataset("v", layout)
