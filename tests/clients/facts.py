"""What every client here prints: a line for each fact that holds. One that does not ends the client."""


def check(fact, holds):
    assert holds, fact
    print("ok", fact, flush=True)


def upright(attitude):
    """Whether the nose points up in NED, whatever the heading: the nose's share of the down axis is -1."""
    return 2 * (attitude.w * attitude.y - attitude.x * attitude.z) > 0.99
