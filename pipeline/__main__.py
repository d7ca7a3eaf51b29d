"""`python -m pipeline` and the command `hinterland`."""

import sys


def main() -> None:
    """Run ``hinterland plan ...``, or the whole pipeline; each is imported only when it is wanted."""
    if sys.argv[1:2] == ["plan"]:
        from pipeline.stages.plan_command import main as plan

        sys.exit(plan(sys.argv[2:]))
    from pipeline.stages.repro import main as reproduce

    reproduce()


if __name__ == "__main__":
    main()
