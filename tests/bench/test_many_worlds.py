from bench.many_worlds import measure


def test_the_ways_in_which_many_worlds_step_are_compared(capsys):
    measure("FR5Grasp-v0", 2, rounds=1, frames=2)
    title, _, *rows = capsys.readouterr().out.splitlines()
    assert title.startswith("2 worlds of FR5Grasp-v0")
    names = [row[:20].rstrip() for row in rows]
    assert {"one after another", "1 thread", "a process each"} <= set(names)
    assert rows[0].split()[-1] == "1.00"
    assert all(float(number) > 0 for row in rows for number in row[20:].split())
