"""Scratch memory is lent to one thread at a time, also where another takes the last piece."""

from concurrent.futures import ThreadPoolExecutor

from accelscope.core.parallel import Spare


class Taken(list):
    """A list that looks filled and is empty: another thread has been faster."""

    def __bool__(self):
        return True

    def __len__(self):
        return 1


def test_the_last_piece_may_be_gone():
    spare = Spare(object)
    spare._kept = Taken()
    with spare.lent() as piece:
        assert piece is not None


def test_a_piece_belongs_to_one_thread():
    made = []

    def make():
        made.append([0])
        return made[-1]

    spare = Spare(make)

    def work(_):
        with spare.lent() as piece:
            piece[0] += 1
            assert piece[0] == 1
            piece[0] -= 1

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(5000)))
    assert 1 <= len(made) <= 8
