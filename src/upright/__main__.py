"""How do I start it when the script is not on the path? `python -m upright`."""

from __future__ import annotations

from upright.cli import main

if __name__ == "__main__":
    main()
