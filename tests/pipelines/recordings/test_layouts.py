"""Layouts out of TOML files: what is no layout is refused in a sentence that names the value."""

import pytest
from toy_recording import ANNOTATION, LAYOUT

from pipelines.errors import UserError
from pipelines.recordings.layout import read_layout

TEXT = LAYOUT.format(format="png")
JOINTS = ANNOTATION.format(names='["a", "b"]', joints='head = "a"')


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("width = 64", "width = -64", "-64"),
        ("width = 64", "width = 0", "0x48"),
        ("width = 64", f"width = {10**20}", "1..8192"),
        ("width = 64", "width = 1e20", "must be int"),
        ("width = 64", f"width = {'9' * 5000}", "x.toml"),
        ("fx = 60.0", "fx = inf", "fx=inf must be in"),
        ("fx = 60.0", "fx = nan", "fx=nan must be in"),
        ("fx = 60.0", "fx = -60.0", "fx=-60.0 must be in"),
        ("fx = 60.0", "fx = 0", "fx=0.0 must be in"),
        ("cx = 31.5", "cx = 1e20", "cx=1e"),
        ("cx = 31.5", "cx = 31.5, tilt_deg = nan", "tilt_deg=nan"),
        ("cx = 31.5", "cx = 31.5, height_m = inf", "height_m=inf"),
        ("height = 48", "height = 48\nmm_per_unit = nan", "mm_per_unit=nan"),
        ("height = 48", "height = 48\nmm_per_unit = inf", "mm_per_unit=inf"),
        ("height = 48", "height = 48\nmm_per_unit = 0", "mm_per_unit=0.0"),
        ("height = 48", "height = 48\nmm_per_unit = -1", "mm_per_unit=-1.0"),
        ("height = 48", "height = 48\nmm_per_unit = 1e20", "mm_per_unit=1e"),
        ("height = 48", "height = 48\nbig_endian = true", "use swap_bytes"),
        ("height = 48", "height = 48\n[foreground]\nfar = inf", "far=inf"),
        ("height = 48", "height = 48\n[foreground]\nnear = nan", "near=nan"),
        ("height = 48", "height = 48\n[foreground]\nnear = 3\nfar = 2", "0 <= near < far"),
        ("height = 48", "height = 48\n[[foreground.boxes]]\npixels = [0, 0, -4, 9]", "left before right"),
        ("height = 48", "height = 48\n[[foreground.boxes]]\npixels = [70, 0, 90, 9]", "outside of the image"),
        ("height = 48", "height = 48\n[[foreground.boxes]]\npixels = [0, 0, 1e20, 9]", "must be int"),
        ("height = 48", "height = 48\nforeground = [[[[1]]]]", "foreground"),
        ("height = 48", "height = 48\nforeground = { boxes = [[1, 2]] }", "boxes"),
        ('files = "d_*.png"', 'files = "/etc/*"', "without /"),
        ('files = "d_*.png"', 'files = "../*.png"', "without /"),
        ('files = "d_*.png"', 'files = ""', "''"),
        ('files = "d_*.png"', 'files = "*_*.png"', "at most one"),
        ("recognised_by = []", 'recognised_by = ["/*"]', "without /"),
        ('files = "j_{}.txt"', 'files = "../j_{}.txt"', "name of a file in the folder"),
        ('files = "j_{}.txt"', 'files = "j_{}.txt"\nshift_px = [nan, 0]', "shift_px"),
        ('names = ["a", "b"]', 'names = ["a", "a"]', "each once"),
        ('head = "a"', 'nose = "a"', "joint 'nose' is unknown"),
        (
            'files = "j_{}.txt"',
            'files = "j_{}.txt"\nguides = { neck = { a = inf, b = -inf } }',
            "weights of guide neck",
        ),
        ('files = "j_{}.txt"', 'files = "j_{}.txt"\nguides = { neck = { a = 0.5 } }', "must sum to 1"),
        ("height = 48", "height = " + "[" * 5000, "x.toml"),
        ("height = 48", "height = " + "{a=" * 5000, "x.toml"),
        ("height = 48", "height = 48\n\udcff = 1", "x.toml"),
    ],
)
def test_values_that_no_layout_has_are_refused_by_name(tmp_path, old, new, message):
    text = TEXT + JOINTS
    assert old in text
    path = tmp_path / "x.toml"
    # Tables follow all plain keys.
    head, _, extra = new.partition("\n[")
    changed = text.replace(old, head, 1)
    if extra:
        before, annotation = changed.split("[annotation]")
        changed = before + "[" + extra + "\n[annotation]" + annotation
    path.write_bytes(changed.encode("utf-8", "surrogateescape"))
    with pytest.raises(UserError) as caught:
        read_layout(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_layout_says_the_unit_of_floats_and_that_bytes_are_swapped(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text(TEXT.replace("height = 48", "height = 48\nmm_per_unit = 1\nswap_bytes = true"))
    layout = read_layout(path)
    assert (layout.mm_per_unit, layout.swap_bytes) == (1.0, True)
