"""A frame that was changed on the disk is not taken for a good one."""

from pathlib import Path

import h5py
import pytest

from shared_runs import mics

CASE = """&run t_end = 0.02  dt = 0.01  field_interval = 0.01 /
&grid cells = 12, 12, 12  length = 1, 1, 1 /
&water min = 0, 0, 0  max = 0.5, 1, 0.5 /
"""


@pytest.mark.parametrize("name", ["liquid", "velocity", "pressure"])
def test_changed_frame(name: str, tmp_path: Path) -> None:
    """One bit of each chunk of a field, anywhere in it: HDF5 refuses the chunk."""
    assert mics(tmp_path, CASE).returncode == 0
    file = tmp_path / "mics-out" / "fields.vtkhdf"
    with h5py.File(file) as h5:
        field = h5[f"VTKHDF/CellData/{name}"]
        assert field.fletcher32
        chunk = field.id.get_chunk_info(field.id.get_num_chunks() - 1)
    data = bytearray(file.read_bytes())
    data[chunk.byte_offset + chunk.size // 2] ^= 1
    file.write_bytes(data)
    with h5py.File(file) as h5, pytest.raises(OSError, match="[Cc]hecksum|fletcher|filter"):
        h5[f"VTKHDF/CellData/{name}"][...]
