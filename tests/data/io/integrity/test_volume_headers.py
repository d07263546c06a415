"""Headers of volumes, made by hand from the definitions of their formats."""

from __future__ import annotations

import gzip
import struct
import zlib

import pytest

from simplexmesh.data.io.integrity import volumes

both = pytest.mark.parametrize("order", ["<", ">"])


def nifti(order, version, dims=(3, 4, 5, 6), bits=16, offset=352, slope=2.0, shift=-1.0, magic=b"n+"):
    """A header: nifti_1_header, or nifti_2_header."""
    dims = (*dims, *(9,) * (8 - len(dims)))
    if version == 1:
        head = bytearray(348 + 4)
        struct.pack_into(order + "i", head, 0, 348)
        struct.pack_into(order + "8h", head, 40, *dims)
        struct.pack_into(order + "h", head, 72, bits)
        struct.pack_into(order + "3f", head, 108, offset, slope, shift)
        head[123] = 2
        head[344:347] = magic + b"1"
    else:
        head = bytearray(540 + 4)
        struct.pack_into(order + "i", head, 0, 540)
        head[4:7] = magic + b"2"
        struct.pack_into(order + "h", head, 14, bits)
        struct.pack_into(order + "8q", head, 16, *dims)
        struct.pack_into(order + "q", head, 168, offset)
        struct.pack_into(order + "2d", head, 176, slope, shift)
        struct.pack_into(order + "i", head, 500, 2)
    return bytes(head)


@both
@pytest.mark.parametrize("version", [1, 2])
class TestNifti:
    @pytest.mark.parametrize(
        ("dims", "samples"), [((3, 4, 5, 6), 120), ((2, 4, 5), 20), ((0,), 1), ((-1,), 1), ((7, *(2,) * 7), 128),
                              ((9, *(2,) * 7), 128)]
    )  # fmt: skip
    @pytest.mark.parametrize(("bits", "offset"), [(16, 352), (1, 544), (64, 1000)])
    def test_size(self, order, version, dims, samples, bits, offset):
        assert volumes.nifti_size(nifti(order, version, dims, bits, offset)) == offset + samples * bits // 8

    def test_scaling(self, order, version):
        head = nifti(order, version)
        at, form, slope, shift = volumes.nifti_scaling(head)
        assert (slope, shift) == (2, -1) == struct.unpack_from(form, head, at)

    def test_units(self, order, version):
        assert nifti(order, version)[volumes.nifti_unit_place(nifti(order, version))] == 2

    def test_pairs(self, order, version):
        assert volumes.is_nifti_pair(nifti(order, version, magic=b"ni"))
        assert not volumes.is_nifti_pair(nifti(order, version))

    @pytest.mark.parametrize("packed", [False, True])
    @pytest.mark.parametrize("missing", [0, 1])
    def test_all_samples_are_there(self, order, version, packed, missing, tmp_path):
        head = nifti(order, version, offset=544)
        content = head + bytes(544 + 240 - len(head) - missing)
        path = tmp_path / "a.nii"
        path.write_bytes(gzip.compress(content) if packed else content)
        if missing:
            with pytest.raises(OSError, match=r"a.nii must have 784 bytes, it has 783: truncated"):
                volumes.check_nifti(path)
        else:
            volumes.check_nifti(path)

    @pytest.mark.parametrize("ending", [".img", ".IMG", ".img.gz"])
    def test_samples_beside(self, order, version, ending, tmp_path):
        path = tmp_path / "a.hdr"
        path.write_bytes(nifti(order, version, offset=0, magic=b"ni"))
        with pytest.raises(FileNotFoundError, match=r"a.hdr refers to a.img, which is not in its folder"):
            volumes.check_nifti(path)
        pack = gzip.compress if ending == ".img.gz" else bytes
        (tmp_path / f"a{ending}").write_bytes(pack(bytes(240)))
        volumes.check_nifti(path)
        (tmp_path / f"a{ending}").write_bytes(pack(bytes(239)))
        with pytest.raises(OSError, match=r"must have 240 bytes( in a.(img|IMG))?, it has 239: truncated"):
            volumes.check_nifti(path)
        (tmp_path / f"a{ending}").write_bytes(pack(bytes(240))[:-1])
        with pytest.raises(OSError, match="truncated"):
            volumes.check_nifti(path)


def test_a_place_before_the_file_is_its_start_and_one_that_is_no_number_is_damage(tmp_path):
    assert volumes.nifti_size(nifti("<", 1, offset=-5.0)) == 240
    (tmp_path / "a.nii").write_bytes(nifti("<", 1, offset=float("nan")) + bytes(240))
    with pytest.raises(OSError, match=r"^a.nii is a NIfTI file with a damaged header$"):
        volumes.check_nifti(tmp_path / "a.nii")


class TestPacked:
    @pytest.mark.parametrize("pack", [zlib.compress, gzip.compress])
    def test_what_is_unpacked_is_counted(self, pack, tmp_path):
        path, packed = tmp_path / "a", pack(bytes(range(200)) * 1000)
        path.write_bytes(b"head" + packed)
        n = len(packed)
        assert volumes._unpacked_size(path, 4, n, 200_000) == 200_000
        assert volumes._unpacked_size(path, 4, n + 9, 200_000) == 200_000
        assert volumes._unpacked_size(path, 4, n - 1, 200_000) == -1
        assert volumes._unpacked_size(path, 3, n, 200_000) == -1
        path.write_bytes(b"head" + packed + b"tail")
        assert volumes._unpacked_size(path, 4, n + 4, 200_000) == 200_000

    def test_streams_that_follow_each_other_are_one(self, tmp_path):
        path = tmp_path / "a"
        path.write_bytes(gzip.compress(bytes(100)) + gzip.compress(bytes(23)))
        assert volumes._unpacked_size(path, 0, path.stat().st_size, 123) == 123

    def test_no_more_is_unpacked_than_asked_for(self, tmp_path):
        path = tmp_path / "a"
        path.write_bytes(zlib.compress(bytes(20 * volumes.MEGABYTE)))
        found = volumes._unpacked_size(path, 0, path.stat().st_size, 10)
        assert found > volumes.MEGABYTE


MHA = "NDims = 3\nDimSize = 2 3 4\nElementType = MET_{}\n{}ElementDataFile = LOCAL\n"


class TestMetaImage:
    @pytest.mark.parametrize(
        ("kind", "more", "size"),
        [("UCHAR", "", 24), ("CHAR", "Rotation = 1e6 0 0 0 1 0 0 0 -1e6\n", 24), ("USHORT", "", 48),
         ("SHORT", "ElementNumberOfChannels = 3\n", 144),
         ("UINT", "", 96), ("LONG", "", 96), ("ULONG_LONG", "", 192), ("FLOAT", "", 96), ("DOUBLE", "", 192)],
    )  # fmt: skip
    def test_all_samples_are_there(self, kind, more, size, tmp_path):
        path = tmp_path / "a.mha"
        head = MHA.format(kind, more).encode()
        path.write_bytes(head + bytes(size))
        volumes.check_metaimage(path)
        path.write_bytes(head + bytes(size - 1))
        with pytest.raises(OSError, match=r"a.mha must have \d+ bytes, it has \d+: truncated"):
            volumes.check_metaimage(path)

    def test_a_size_of_many_digits_is_not_repeated(self, tmp_path):
        path = tmp_path / "a.mha"
        path.write_text(MHA.format("UCHAR", "").replace("DimSize = 2", "DimSize = " + "2" * 400))
        with pytest.raises(OSError, match=r"a.mha must have more than 2\^64 bytes, it has \d+: truncated"):
            volumes.check_metaimage(path)

    @pytest.mark.parametrize("skipped", ["0", "7", "-1"])
    def test_samples_beside_it_after_a_header(self, skipped, tmp_path):
        path = tmp_path / "a.mhd"
        path.write_text(MHA.format("UCHAR", f"HeaderSize = {skipped}\n").replace("LOCAL", "a.raw"))
        with pytest.raises(FileNotFoundError, match=r"a.mhd refers to a.raw, which is not in its folder"):
            volumes.check_metaimage(path)
        size = 24 + max(int(skipped), 0)
        (tmp_path / "a.raw").write_bytes(bytes(size))
        volumes.check_metaimage(path)
        (tmp_path / "a.raw").write_bytes(bytes(size - 1))
        with pytest.raises(OSError, match=rf"a.mhd must have {size} bytes in a.raw, it has {size - 1}: truncated"):
            volumes.check_metaimage(path)

    @pytest.mark.parametrize("flag", ["True", "true", "1"])
    @pytest.mark.parametrize("count", [23, 24, 25])
    def test_packed_samples_are_as_many(self, flag, count, tmp_path):
        path, packed = tmp_path / "a.mha", zlib.compress(bytes(count))
        head = MHA.format("UCHAR", f"CompressedData = {flag}\nCompressedDataSize = {len(packed)}\n")
        path.write_bytes(head.encode() + packed)
        if count == 24:
            volumes.check_metaimage(path)
        else:
            with pytest.raises(OSError, match=r"a.mha has damaged compressed samples"):
                volumes.check_metaimage(path)
        path.write_bytes(head.encode() + packed[:-1])
        with pytest.raises(OSError, match="truncated"):
            volumes.check_metaimage(path)

    @pytest.mark.parametrize(
        ("more", "message"),
        [
            ("CompressedData = True\n", "a.mha is a compressed MetaImage without CompressedDataSize"),
            ("ElementSpacing = 1 1\n", "a.mha has a damaged header: ElementSpacing must have 3 numbers, not 2"),
            ("ElementSpacing = 1 0 1\n", "a.mha must have positive spacing, not ElementSpacing = 1 0 1"),
            ("ElementSize = 1 -1 1\n", "a.mha must have positive spacing, not ElementSize = 1 -1 1"),
            ("HeaderSize = x\n", "a.mha is a MetaImage with a damaged header"),
            ("Orientation = 1 0 0 0 1 0 0 0 x\n", "a.mha has a damaged header: Orientation = 1 0 0"),
            ("Rotation = 1 0 0 0 1 0 0 0 -1.1e6\n", "a.mha has a damaged header: Rotation = 1 0 0"),
        ],
    )
    def test_damaged_headers(self, more, message, tmp_path):
        path = tmp_path / "a.mha"
        path.write_bytes(MHA.format("UCHAR", more).encode() + bytes(24))
        with pytest.raises(OSError, match=message):
            volumes.check_metaimage(path)

    @pytest.mark.parametrize("line", ["DimSize", "ElementType", "ElementDataFile"])
    def test_lines_that_must_be_there(self, line, tmp_path):
        path = tmp_path / "a.mha"
        path.write_bytes(MHA.format("UCHAR", "").replace(line, "Other").encode() + bytes(24))
        with pytest.raises(OSError, match=r"a.mha is a MetaImage header without DimSize"):
            volumes.check_metaimage(path)


class TestNrrd:
    @pytest.mark.parametrize("missing", [0, 1])
    @pytest.mark.parametrize("encoding", ["gzip", "gz", "GZIP"])
    @pytest.mark.parametrize("beside", [False, True])
    def test_packed_samples(self, encoding, beside, missing, tmp_path):
        packed = gzip.compress(bytes(24))[: -1 - missing or None] if missing else gzip.compress(bytes(24))
        head = f"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: {encoding}\n"
        path = tmp_path / "a.nrrd"
        path.write_bytes(head.encode() + (b"data file: a.raw.gz\n\n" if beside else b"\n" + packed))
        (tmp_path / "a.raw.gz").write_bytes(packed)
        if missing:
            with pytest.raises(OSError, match=r"a.nrrd has damaged compressed samples"):
                volumes.check_nrrd(path)
            path.write_bytes(path.read_bytes().replace(b"encoding", b"byte skip: 1\nencoding"))  # left to ITK
        volumes.check_nrrd(path)

    @pytest.mark.parametrize(
        ("kinds", "size"),
        [(("signed char", "uchar", "uint8_t", "int8"), 1), (("short int", "ushort", "uint16"), 2),
         (("int", "unsigned int", "int32_t", "float"), 4), (("long long", "ulonglong", "uint64_t", "double"), 8)],
    )  # fmt: skip
    def test_bytes_of_samples(self, kinds, size):
        for kind in kinds:
            assert volumes._nrrd_size({"sizes": "2 3 4", "type": kind}) == size * 24
            assert volumes._nrrd_size({"sizes": "2 3 -4", "type": kind}) == 0
        assert volumes._nrrd_size({"sizes": "2 3 4", "type": "block"}) == 0

    @pytest.mark.parametrize(("encoding", "most"), [("raw", 1), ("hex", 1), ("ascii", 4), ("gzip", 1040)])
    @pytest.mark.parametrize("more", ["", "line skip: 1\n"])
    def test_more_samples_than_so_many_bytes_can_hold(self, encoding, most, more, tmp_path):
        head = f"NRRD0004\ntype: short\ndimension: 3\nsizes: 1 1 {{}}\nencoding: {encoding}\n{more}\n"
        samples = gzip.compress(bytes(100_000)) if encoding == "gzip" else b"0 " * 50
        path, count = tmp_path / "a.nrrd", most * len(samples) // 2
        path.write_bytes(head.format(count + 1).encode() + samples)
        with pytest.raises(OSError, match=rf"a.nrrd must have {2 * count + 2:,} bytes of samples, it has .* at most"):
            volumes.check_nrrd(path)
        path.write_bytes(head.format(50_000 if encoding == "gzip" else count).encode() + samples)
        volumes.check_nrrd(path)

    def test_fewer_packed_samples_than_the_header_says(self, tmp_path):
        head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 1 1 {}\nencoding: gzip\n\n"
        for count in (50_000, 50_001):
            (tmp_path / "a.nrrd").write_bytes(head.format(count).encode() + gzip.compress(bytes(100_000)))
            if count == 50_000:
                volumes.check_nrrd(tmp_path / "a.nrrd")
        with pytest.raises(OSError, match=r"a.nrrd must have 100,002 bytes of samples, it has 100,000 at most: trunc"):
            volumes.check_nrrd(tmp_path / "a.nrrd")


SHORT, LONG = 3, 4


def tiff(order, big, pages, last=0):
    """Pages of tags and numbers, each followed by the place of the next."""
    offset, count, tag = ("Q", "Q", "HHQQ") if big else ("I", "H", "HHII")
    head = struct.pack(order + "2sHHHQ" if big else order + "2sHI",
                       *((b"MM", b"II")[order == "<"], 43, 8, 0, 16) if big else ((b"MM", b"II")[order == "<"], 42, 8)
                       )  # fmt: skip
    out = head
    for number, page in enumerate(pages):
        entry = struct.calcsize(order + tag)
        end = len(out) + struct.calcsize(order + count) + entry * len(page) + struct.calcsize(order + offset)
        out += struct.pack(order + count, len(page))
        for key, value in page.items():
            kind = LONG if key == 256 else SHORT
            held = struct.pack(order + ("I" if kind == LONG else "H"), value).ljust(8 if big else 4, b"\0")
            out += struct.pack(order + tag[:-1], key, kind, 1) + held
        out += struct.pack(order + offset, end if number < len(pages) - 1 else last)
    return out


GRAY = {256: 70_000, 257: 4, 258: 16, 277: 1, 339: 1}
big = pytest.mark.parametrize("big", [False, True])


@both
@big
class TestTiff:
    def check(self, folder, content):
        (folder / "a.tif").write_bytes(content)
        volumes.check_tiff(folder / "a.tif")

    def test_pages_of_one_kind_are_sound_and_those_in_a_circle_end(self, order, big, tmp_path):
        self.check(tmp_path, tiff(order, big, [GRAY, GRAY | {254: 2}, GRAY | {254: 1, 256: 7}]))
        colors = GRAY | {277: 3}
        self.check(tmp_path, tiff(order, big, [colors, colors | {258: 99}]))
        self.check(tmp_path, tiff(order, big, [{256: 1, 257: 1}, {256: 1, 257: 1, 258: 1, 277: 1, 339: 1}]))
        self.check(tmp_path, tiff(order, big, [GRAY], last=16 if big else 8))

    @pytest.mark.parametrize("tag", [256, 257, 258, 277, 339])
    def test_pages_of_other_kinds(self, order, big, tag, tmp_path):
        with pytest.raises(OSError, match=r"a.tif must have images of one size and type in its 2 pages"):
            self.check(tmp_path, tiff(order, big, [GRAY, GRAY | {tag: 2}]))

    def test_tiles(self, order, big, tmp_path):
        with pytest.raises(OSError, match=r"a.tif is a tiled TIFF file; only strips are supported"):
            self.check(tmp_path, tiff(order, big, [GRAY | {322: 16}]))

    @pytest.mark.parametrize("cut", [1, 20, 50, 60])
    def test_truncated(self, order, big, cut, tmp_path):
        with pytest.raises(OSError, match=r"a.tif ends within page 2 of its images: truncated"):
            self.check(tmp_path, tiff(order, big, [GRAY, GRAY])[:-cut])

    def test_less_than_a_header(self, order, big, tmp_path):
        with pytest.raises(OSError, match=r"a.tif has only 15 bytes: truncated"):
            self.check(tmp_path, tiff(order, big, [GRAY])[:15])
