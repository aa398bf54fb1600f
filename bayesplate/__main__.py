"""`python -m bayesplate`: the command line of an environment whose scripts are not on the path."""

from bayesplate.cli import main

if __name__ == "__main__":
    main(prog_name="bayesplate")
