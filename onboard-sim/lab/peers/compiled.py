"""CasADi's C code of a problem, compiled.

Nearly all of the compiler's work is in the derivatives of one interval, straight lines of thousands of operations, which
are the same for every length of the horizon. They are compiled once, and linked to each.
"""

import hashlib
import os
import re
import subprocess

import casadi as ca

FLAGS = ["-march=native", "-fPIC"]

# Of the intervals' derivatives always, of what puts them together where asked. Without it a Hessian takes a sixth longer.
FULLY = "-O3"
QUICKLY = "-O1"

# A function this long, in lines, is compiled apart if it is arithmetic alone.
LONG = 100

FUNCTION = re.compile(r"^static int (casadi_f\d+)\((?:.*\n)*?^}\n", re.MULTILINE)
PREAMBLE = """#include <math.h>
#define casadi_real double
#define casadi_int long long int
#define casadi_sq(x) ((x) * (x))
"""


def compiler(*words):
    subprocess.check_call([os.environ.get("CC", "cc"), *FLAGS, *words])


def _arithmetic(body):
    """Whether a function needs nothing that the preamble has not."""
    return body.count("\n") > LONG and set(re.findall(r"casadi_\w+", body)) <= {"casadi_real", "casadi_int", "casadi_sq"}


def _apart(source, folder):
    """Compiles the long functions of a source; the source without them, and their objects."""
    objects = []
    for match in list(FUNCTION.finditer(source)):
        name, text = match.group(1), match.group(0)
        if not _arithmetic(text.replace(name, "", 1)):
            continue
        body = text.removeprefix("static ")
        shared = "interval_" + hashlib.sha256(body.replace(name, "", 1).encode()).hexdigest()[:16]
        body = body.replace(name, shared, 1)
        compiled = os.path.join(folder, shared + ".o")
        if not os.path.exists(compiled):
            partial = f"{compiled}.{os.getpid()}"
            with open(partial + ".c", "w", encoding="utf-8") as file:
                file.write(PREAMBLE + body)
            compiler(FULLY, "-c", partial + ".c", "-o", partial)
            os.remove(partial + ".c")
            os.rename(partial, compiled)
        objects.append(compiled)
        declared = body[: body.index(" {")] + ";\n"
        source = source.replace(text, declared).replace(f"#define {name} CASADI_PREFIX({name[7:]})\n", "")
        source = re.sub(rf"\b{name}\b", shared, source)
    return source, objects


def functions(solver, problem, options, library, effort):
    """Makes a shared library of a problem's functions and derivatives as `solver` wants them, if there is none."""
    if os.path.exists(library):
        return
    generator = ca.nlpsol("S", solver, problem, options)
    folder, source, partial = os.path.dirname(library), library[:-3] + ".c", library + ".partial"
    os.chdir(folder)  # CasADi writes into the working directory
    generator.generate_dependencies(os.path.basename(source))
    with open(source, encoding="utf-8") as file:
        text, objects = _apart(file.read(), folder)
    with open(source, "w", encoding="utf-8") as file:
        file.write(text)
    compiler(effort, "-shared", source, *objects, "-o", partial)
    os.remove(source)
    os.rename(partial, library)
