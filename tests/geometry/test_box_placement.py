import numpy as np
import pytest

from corporeal.geometry import box_placement


def boxes(*sizes, at=None):
    size = np.array(sizes, float)
    low = np.zeros_like(size) if at is None else np.array(at, float)
    return np.stack([low, low + size], axis=1)


SIZES = ((1, 2, 3), (0.1, 0.1, 0.1), (5, 1, 0.2))


@pytest.mark.parametrize("place", [box_placement.row_shifts, box_placement.stack_shifts])
def test_placed_boxes_share_no_volume_and_none_is_below_the_floor(place):
    b = boxes(*SIZES, at=[[3, 1, -7], [0, 0, 0], [1, 1, 9]])
    b = b + place(b)[:, None]
    assert box_placement.overlapping_boxes(b) == []
    assert b[:, 0, 2].min() == 0


def test_a_row_is_centred_and_keeps_its_order():
    b = boxes(*SIZES)
    b = b + box_placement.row_shifts(b)[:, None]
    assert (np.diff(b[:, 0, 0]) > 0).all()
    assert b[0, 0, 0] == pytest.approx(-b[-1, 1, 0])
    assert np.allclose(b.mean(axis=1)[:, 1], 0)


def test_a_stack_has_the_first_at_the_bottom():
    b = boxes(*SIZES)
    b = b + box_placement.stack_shifts(b)[:, None]
    assert (b[1:, 0, 2] > b[:-1, 1, 2]).all()


def test_an_object_is_lifted_by_its_own_size():
    assert box_placement.lift_heights(boxes((1, 2, 3)), 0.2) == pytest.approx([0.6])


def test_a_cup_rises_with_the_table_it_stands_on():
    table, cup, lamp = (1, 1, 0.8), (0.1, 0.1, 0.1), (0.2, 0.2, 1.5)
    b = boxes(table, cup, lamp, at=[[0, 0, 0], [0.4, 0.4, 0.8], [3, 0, 0]])
    rise = box_placement.lift_heights(b, 0.5)
    assert rise == pytest.approx([0.5, 0.5 + 0.05, 0.75])


def test_a_chair_under_a_table_rises_with_it():
    b = boxes((1, 1, 0.8), (0.4, 0.4, 0.9), at=[[0, 0, 0], [0.3, 0.3, 0]])
    assert box_placement.lift_heights(b, 0.1) == pytest.approx([0.1, 0.1])


def test_boxes_that_only_touch_do_not_overlap():
    assert box_placement.overlapping_boxes(boxes((1, 1, 1), (1, 1, 1), at=[[0, 0, 0], [1, 0, 0]])) == []
    assert box_placement.overlapping_boxes(boxes((1, 1, 1), (1, 1, 1), at=[[0, 0, 0], [0.9, 0, 0]])) == [(0, 1)]
