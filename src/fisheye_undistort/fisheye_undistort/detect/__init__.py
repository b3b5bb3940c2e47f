"""From pictures to views of a target: begin with `gathering`, then `detection`."""
