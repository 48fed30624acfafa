"""`python -m laserimg` is `laserimg`."""

from laserimg.cli import main

if __name__ == "__main__":
    main()
