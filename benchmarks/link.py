"""Prints the table of docs/link.md: what each way across takes of the link and the machines."""

from stages import Stage, measure_stages

SLOW_MBIT_S = 8.0
RATE_HZ = 30.0
RAW_CAMERAS_MBIT_S = 2 * 640 * 480 * 3 * 8e-6 * RATE_HZ
_DECODE, _COMPOSE = 'decode the JPEGs of both cameras', 'compose'
_CAMERAS, _PANORAMA = 'encode both cameras as H.264', 'convert and encode as H.264'
WAYS = (
    ('two cameras, raw', None, [_DECODE], [_COMPOSE]),
    ('two cameras, their own JPEG', _DECODE, [], [_DECODE, _COMPOSE]),
    (
        'two cameras, H.264',
        _CAMERAS,
        [_DECODE, _CAMERAS],
        ['at the base: decode these', _COMPOSE],
    ),
    (
        'panorama, JPEG',
        'encode as JPEG',
        [_DECODE, _COMPOSE, 'encode as JPEG'],
        ['at the base: decode the JPEG'],
    ),
    (
        'panorama, H.264',
        _PANORAMA,
        [_DECODE, _COMPOSE, _PANORAMA],
        ['at the base: decode the H.264'],
    ),
)
"""Name, the stage whose output travels, and the stages on the robot and at the base."""


def main() -> None:
    """Print the table."""
    stages = {stage.name: stage for stage in measure_stages()}
    print('| what travels | Mbit/s | ms on 8 Mbit/s | CPU ms on the robot | at the base |')
    print('| --- | --- | --- | --- | --- |')
    for name, travelling, robot, base in WAYS:
        mbit_s = stages[travelling].mbit_s if travelling else RAW_CAMERAS_MBIT_S
        print(
            f'| {name} | {mbit_s:.1f} | {1e3 * mbit_s / RATE_HZ / SLOW_MBIT_S:.0f} '
            f'| {total_ms(stages, robot):.1f} | {total_ms(stages, base):.1f} |'
        )


def total_ms(stages: dict[str, Stage], names: list[str]) -> float:
    """Return the processor time of some stages, ms."""
    return sum(stages[name].cpu_ms.median for name in names)


if __name__ == '__main__':
    main()
