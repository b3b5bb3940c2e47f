"""Writes the parameter tables of docs/ from the settings that the nodes declare."""

import re
import sys
from importlib import import_module
from pathlib import Path

from fisheye_core.settings import describe_range, rules

DOCS = Path(__file__).parents[1] / 'docs'
_TABLE = re.compile(r'(<!-- parameters: (\S+) -->\n).*?(<!-- end of parameters -->)', re.DOTALL)
_HEAD = '| parameter | default | values | live | meaning |\n| --- | --- | --- | --- | --- |\n'


def table(dotted_name: str) -> str:
    """Describe a settings dataclass, named with its module, as a Markdown table."""
    module, _, name = dotted_name.rpartition('.')
    rows = [
        f'| `{setting}` | `{_text(default)}` | {describe_range(rule) or _KINDS.get(kind, "")} '
        f'| {"yes" if rule.live else ""} | {rule.help.replace("|", "/")} |\n'
        for setting, (kind, default, rule) in rules(getattr(import_module(module), name)).items()
    ]
    return _HEAD + ''.join(rows)


_KINDS = {str: 'text', bool: 'true or false', float: 'number', int: 'whole number'}


def _text(default) -> str:
    if isinstance(default, tuple):
        return '[' + ', '.join(map(_text, default)) + ']'
    if isinstance(default, bool):
        return str(default).lower()
    return repr(default) if isinstance(default, str) else f'{default:g}'


def updated(page: str) -> str:
    """Return a page with its tables as they should be."""
    return _TABLE.sub(lambda found: found[1] + table(found[2]) + found[3], page)


def main() -> None:
    """Rewrite every page whose tables are out of date."""
    for path in sorted(DOCS.glob('*.md')):
        page = path.read_text()
        if (new := updated(page)) != page:
            path.write_text(new)
            print(f'{path.name} updated')


if __name__ == '__main__':
    sys.exit(main())
