"""Files that figures are written to."""

from pathlib import Path

from matplotlib.figure import Figure

from fisheye_core.errors import FileAccessError, SettingError

FORMATS = ('.pdf', '.svg', '.png')


def check_suffix(path: Path, what: str) -> None:
    """Refuse a name that says no format; `what` the figure is, for the sentence.

    Raises
    ------
    SettingError
        For another suffix than those of `FORMATS`.
    """
    if path.suffix.lower() not in FORMATS:
        raise SettingError(
            f"{what} '{path.name}' cannot be written; "
            f'expected a name that ends in {", ".join(FORMATS)}'
        )


def write_figure(figure: Figure, path: Path, dpi: float) -> None:
    """Write a figure in the format that the name says.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    try:
        figure.savefig(path, dpi=dpi)
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or error
        raise FileAccessError(path, 'written', reason) from error
