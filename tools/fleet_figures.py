"""The figures that `./run long fleet` prints at its end: each of its tools adds lines to a file."""


def add_option(parser):
    parser.add_argument("--figures", metavar="FILE", help="add the figures of this run to a file, a line each")


def note(arguments, figure, value, limit, is_met):
    """limit: text; is_met: whether the value keeps to it. None for both: there is no limit."""
    if arguments.figures is None:
        return
    verdict = "" if is_met is None else "met" if is_met else "NOT MET"
    with open(arguments.figures, "a", encoding="utf-8") as file:
        file.write("\t".join((figure, str(value), limit or "-", verdict)) + "\n")
