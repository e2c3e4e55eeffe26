"""Write the files of this folder: one small free block in each format; see README.md.

Run as ``python tests/data/make.py``; the files of the other programs are written line by line,
as those programs do.
"""

from pathlib import Path

import h5py
import numpy as np
import pyuff
import scipy.io
import scipy.sparse as sp

from fecontact import ElasticBody, Material, Mesh, modal_basis

HERE = Path(__file__).parent
COLUMNS, ROWS, LENGTH, HEIGHT = 4, 2, 0.1, 0.04
FIRST_NODE = 101
MODES = 8


def block():
    """The body: 4 x 2 bilinear cells, 15 nodes in rows from the lower left, 30 unknowns."""
    x, y = np.meshgrid(np.linspace(0.0, LENGTH, COLUMNS + 1), np.linspace(0.0, HEIGHT, ROWS + 1))
    number = np.arange(x.size).reshape(x.shape)
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1)
    bottom = np.column_stack([number[0, :-1], number[0, 1:]])
    mesh = Mesh(np.column_stack([x.ravel(), y.ravel()]), cells.reshape(-1, 4), {"bottom": bottom},
                {"B": int(number[1, 0]), "C": int(number[-1, 2])})
    return ElasticBody(mesh, Material(2.1e11, 0.3, 7850.0), thickness=0.02, degree=1)


def coordinate(path, matrix):
    """Abaqus, FORMAT=COORDINATE: both triangles, counted from 1, no heading."""
    entries = sp.coo_array(sp.triu(matrix))
    with path.open("w", newline="\n") as file:
        for row, column, value in zip(entries.row + 1, entries.col + 1, entries.data, strict=True):
            file.write(f"{row} {column} {value: .15e}\n")
            if row != column:
                file.write(f"{column} {row} {value: .15e}\n")


def matrix_input(path, matrix):
    """Abaqus, FORMAT=MATRIX INPUT: the lower triangle by columns, node and direction."""
    entries = sp.coo_array(sp.csc_array(sp.tril(matrix)))
    with path.open("w", newline="\n") as file:
        for row, column, value in zip(entries.row, entries.col, entries.data, strict=True):
            file.write(f"{FIRST_NODE + row // 2},{row % 2 + 1}, "
                       f"{FIRST_NODE + column // 2},{column % 2 + 1}, {value: .15e}\n")


def matlab_73(path, matrices):
    """MATLAB 7.3: HDF5 behind a block of 512 bytes, sparse matrices as groups."""
    with h5py.File(path, "w", userblock_size=512, libver="earliest") as file:
        for name, matrix in matrices.items():
            group = file.create_group(name)
            group.attrs["MATLAB_class"] = np.bytes_("double")
            group.attrs["MATLAB_sparse"] = np.uint64(matrix.shape[0])
            group["data"] = matrix.data
            group["ir"] = matrix.indices.astype(np.uint64)
            group["jc"] = matrix.indptr.astype(np.uint64)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")


def universal(path, body):
    """Data sets 164, 2411 and 55: the largest component of each shape is one."""
    basis = modal_basis(body, MODES, contact="bottom")
    shapes = basis.mode_shapes.shapes
    scale = np.abs(shapes).max(axis=(0, 1))
    nodes = FIRST_NODE + np.arange(len(shapes))
    zeros = np.zeros(len(nodes))
    sets = [pyuff.prepare_164(units_code=1, units_description="SI: Meter (newton)", temp_mode=1,
                              length=1.0, force=1.0, temp=1.0, temp_offset=273.15),
            pyuff.prepare_2411(node_nums=nodes.tolist(), def_cs=[1] * len(nodes),
                               disp_cs=[1] * len(nodes), color=[11] * len(nodes),
                               x=body.nodes[:, 0], y=body.nodes[:, 1], z=zeros)]
    for k, frequency in enumerate(basis.frequencies_hz):
        x, y = (shapes[:, :, k] / scale[k]).T
        sets.append({
            "type": 55, "model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8,
            "load_case": 1, "mode_n": k + 1, "freq": float(frequency),
            "modal_m": float(1.0 / scale[k] ** 2), "modal_damp_vis": 0.01 * (frequency > 0.0),
            "modal_damp_his": 0.0, "node_nums": nodes, "r1": x, "r2": y, "r3": zeros})
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets(sets, mode="add")


def main():
    body = block()
    M, K = sp.csc_array(body.mass), sp.csc_array(body.stiffness)
    for name, short, matrix in (("mass", "MASS", M), ("stiffness", "STIF", K)):
        matrix.sort_indices()
        scipy.io.mmwrite(HERE / f"block_{name}.mtx", sp.coo_array(matrix), symmetry="symmetric",
                         precision=16)
        coordinate(HERE / f"block_{short}1.mtx", matrix)
        matrix_input(HERE / f"block_{short}2.mtx", matrix)
        sp.save_npz(HERE / f"block_{name}.npz", matrix)
        np.save(HERE / f"block_{name}.npy", matrix.toarray())
    np.savez_compressed(HERE / "block.npz", M=M.toarray(), K=K.toarray())
    scipy.io.savemat(HERE / "block.mat", {"M": M, "K": K}, do_compression=True)
    matlab_73(HERE / "block_v73.mat", {"M": M, "K": K})
    universal(HERE / "block.uff", body)


if __name__ == "__main__":
    main()
