"""The browsers that look: how many, and who has to go for whom."""

from collections.abc import Callable, Iterator

from panorama_viewer.browser import Browser


class Audience:
    """Has places; whoever has the token gets one, if need be that of somebody who has not."""

    def __init__(self, places: int, changed: Callable[[], None]):
        """Open; `changed` is called when the first browser comes and when the last one leaves."""
        self._places, self._changed = places, changed
        self._browsers: dict[Browser, None] = {}

    def __len__(self) -> int:
        return len(self._browsers)

    def __iter__(self) -> Iterator[Browser]:
        return iter(list(self._browsers))

    def enter(self, browser: Browser) -> bool:
        """Admit a browser; return whether there was room."""
        if len(self) >= self._places:
            stranger = next((b for b in self._browsers if not b.is_known), None)
            if not browser.is_known or stranger is None:
                return False
            self.leave(stranger)
            stranger.show_out('somebody with the token needed the place')
        self._browsers[browser] = None
        if len(self) == 1:
            self._changed()
        return True

    def leave(self, browser: Browser) -> None:
        """Free a browser's place, if it has one."""
        if browser in self._browsers:
            del self._browsers[browser]
            if not self._browsers:
                self._changed()
