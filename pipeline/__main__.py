"""`python -m pipeline` and the command `hinterland`."""

from pipeline.stages.repro import main

if __name__ == "__main__":
    main()
