"""The net: what this commit does, written down through its commands and public functions alone.

    python -m tests.net write OLD        on one commit
    python -m tests.net write NEW        on another commit, on the same machine
    python -m tests.net compare OLD NEW  says what differs, and by how much; exit code 1 if anything

`--only faults,commands` writes or compares some of the parts, `--all` says all differences and not
only the worst that a screen holds. A folder has a JSON file for each part:

    channels  each shipped scenario by every law and method: channels, events, quantities, audit,
              warnings, or why the pair is refused. A channel is some samples, its extremes
              and means, and a hash of all its bytes. Runs end after some steps.
    commands  exit code, stdout (JSON as data), stderr and files of sequences of commands
    faults    the same of 300 faulty scenarios, options and files
    reports   the data and the text inside each report of those commands
    files     groups, datasets, types, shapes and attributes of each HDF5 file of those commands
    figures   by `artists`: what each view draws, and coarse frames of animations

It does not see: what takes longer than the runs here, so late motion of belts by slow methods; wall
times, versions, dates and folders, which are masked; and which setting of a cost study is the
fastest; what pictures look like once they are laid out; the scripts of a report at work; sweeps on
several processes, interruptions by signals, terminals. The faulty cases are made from the shipped
scenarios and the golden results: where those change, so do the cases, and `compare` says it.
Hashes are of one machine: another one, or another numpy, may differ in the last digit.
"""
