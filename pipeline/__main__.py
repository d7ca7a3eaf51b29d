"""`python -m pipeline` and the command `hinterland`."""

import sys


def main() -> None:
    """Run ``hinterland plan``, ``hinterland evaluate`` or the whole pipeline; each is imported when it is wanted."""
    if sys.argv[1:2] == ["plan"]:
        from pipeline.stages.plan_command import main as plan

        sys.exit(plan(sys.argv[2:]))
    if sys.argv[1:2] == ["evaluate"]:
        from pipeline.stages.evaluate_command import main as evaluate

        sys.exit(evaluate(sys.argv[2:]))
    from pipeline.stages.repro import main as reproduce

    reproduce()


if __name__ == "__main__":
    main()
