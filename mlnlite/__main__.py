"""`python -m mlnlite` is `mlnlite`."""

from mlnlite.cli import main

if __name__ == "__main__":
    main()
