"""The site that script/site builds of the repository's Markdown and headers: docs/adr/0028-the-site.md. What is not written by hand is
made here: the commands' pages from --help, the documents' fields from their JSON Schemas, C++ from the headers' own comments;
Python's are autodoc's. The sidebar is the list of docs/README.md."""

import glob
import json
import os
import re
import subprocess
import sys

import furo


def read(file):
    with open(file) as text:
        return text.read()


root = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(0, root + "/python")
sys.dont_write_bytecode = True

project = "Flexor"
author = "the authors of Flexor"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
source_suffix = {".md": "markdown", ".hpp": "markdown"}
root_doc = "docs/README"
exclude_patterns = ["**/node_modules", "apps/**.hpp", "cosim/**.hpp", "python/**.hpp", "host/**/templates", "apps/live/missing",
                    "**/test_*.hpp", "**/*_test.hpp", "**/fuzz_*.hpp", "**/random_*.hpp"]
highlight_language = "none"
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 4

html_theme = "furo"
html_title = "Flexor"
html_copy_source = False
html_show_copyright = html_show_sphinx = False
# Debian's furo lacks what makes it dark where the reader's system is: the colours are in it, under another selector.
dark = re.search(r'body\[data-theme="dark"\] \{(.*?)\}', read(os.path.dirname(furo.__file__) + "/theme/furo/static/styles/furo.css"), re.S)[1]
html_theme_options = {"dark_css_variables": dict(re.findall(r"--([\w-]+): ([^;]*);", dark)), "light_css_variables": {"color-code-background": "#f8f8f8"}}
smartquotes = False
pygments_style = "xcode"  # whose colours stand out from the ground

autodoc_mock_imports = ["flexor._flexor", "numpy", "pandas", "sklearn", "scipy", "emcee", "matplotlib", "pylsl", "websockets", "distributed"]
autodoc_default_options = {"members": True, "member-order": "bysource"}
nitpick_ignore_regex = [("py:.*", r"(?!flexor\.).*|flexor\._.*")]


def output_of(*arguments):
    return subprocess.run([os.environ["FLEXOR_PROGRAM"], *arguments], capture_output=True, text=True, check=True).stdout


def toctree(documents, caption=""):
    lines = ["", "```{toctree}", ":hidden:", *([":caption: " + caption] if caption else []), *documents, "```", ""]
    return "\n".join(lines)


# A comment's lines: prose, and as they stand what is indented or has columns, as equations and tables do.
def prose(lines):
    out, is_verbatim = [], False
    for line in lines:
        columns = bool(re.match(r"\s{2}", line) or re.search(r"\S\s{3,}\S", line))
        if columns != is_verbatim:
            out += ["", "```"] if columns else ["```", ""]
        is_verbatim = columns
        out.append(line if columns else re.sub(r"(`[^`]*`)|([\\*_<\[])", lambda m: m[1] or "\\" + m[2], line))
    return "\n".join(out + ["```"] * is_verbatim)


# A header as a page: what it says of itself, then what it declares.
def page_of_header(text, name):
    leading, _, body = text.partition("#pragma once\n")
    says = [re.sub(r"^// ?", "", line) for line in leading.rstrip().split("\n")]
    body = re.sub(r"^#include .*\n|^#(?:if|ifdef|endif|else)\b.*\n(?=#include|\n)", "", body, flags=re.M).strip("\n")
    return f"---\norphan: true\n---\n# {name}\n{prose(says)}\n\n```cpp\n{body}\n```\n"


# A header that is named in code, from its folder or from the root, leads to its page.
def with_links_to_headers(text, name, documents):
    folder = os.path.dirname(name)

    def link(match):
        for place in (os.path.join(folder, match[1]), match[1]):
            if place[:-4] in documents:
                return f"[{match[0]}]({os.path.relpath(place, folder)})"
        return match[0]

    parts = re.split(r"(^```.*?^```)", text, flags=re.M | re.S)
    return "".join(part if part.startswith("```") else re.sub(r"(?<!\[)`([\w/]+\.hpp)`", link, part) for part in parts)


# The lists of docs/README.md as the sidebar, a caption for each section.
def with_sidebar(text):
    def add(section):
        return section[0].rstrip() + "\n" + toctree(links_of(section[2]) + generated.get(section[1], []), section[1]) + "\n"

    return re.sub(r"^## ([^\n]*)\n(.*?)(?=^## |\Z)", add, text, flags=re.M | re.S)


def links_of(text):
    return re.findall(r"\]\(([^)#]*)\.md\)", text)


generated = {"Reference": ["/reference/commands", "/reference/documents", "/reference/python"]}


def escaped(text):
    return re.sub(r"([\\*_<\[|`])", r"\\\1", text)


# What --help prints, a term for each option, and the JSON Schema of the job; commands below it are pages of their own.
def page_of_command(words, folder):
    name, below = "-".join(words), []
    example, text = output_of(*words, "--help").split("\n\n", 1)
    out = [f"# flexor {' '.join(words)}\n\n```sh\n{example}\n```\n"]
    for line in re.sub(r"\n {12,}", "\t", text).split("\n"):
        term, _, says = line[2:].partition("\t") if "\t" in line else (line[2:30], "", line[30:])
        if line.startswith("Usage: "):
            out.append(f"```\n{line[7:]}\n```\n")
        elif re.match(r"\w+:$", line):
            out.append(f"## {line[:-1]}\n")
            names_commands = line == "Subcommands:"
        elif re.match(r"  \S", line) and names_commands:
            term, says = re.split(r"\s{2,}", term.strip())
            below.append(page_of_command([*words, term], folder))
            out.append(f"- [{term}]({below[-1]}.md): {escaped(says)}")
        elif re.match(r"  \S", line):
            out.append(f"`{term.strip()}`\n: {escaped(says)}\n")
        else:
            out.append(escaped(line))
    try:
        out.append(f"## Request of `flexor job {' '.join(words)}`\n```json\n{output_of('job', *words, '--schema')}```")
    except subprocess.CalledProcessError:
        pass  # it is no job
    write(f"{folder}/{name}.md", "\n".join(out) + toctree(below))
    return name


# All of them, in the order and the groups of `flexor help`.
def write_commands(folder):
    out, names = ["# Commands\n"], []
    for line in re.sub(r"\n {12,}.*", "", output_of("help")).split("\n")[6:]:
        command = re.match(r"  (\S+)\s+(.*)", line)
        if command:
            names.append(page_of_command([command[1]], folder + "/commands"))
            out.append(f"- [{command[1]}](commands/{names[-1]}.md): {escaped(command[2])}")
        elif line:
            out.append(f"\n## {line.rstrip(':')}\n")
    write(folder + "/commands.md", "\n".join(out) + toctree(["commands/" + name for name in names]))


# A term for each field, with what it may be.
def fields(schema, path=""):
    for choice in schema.get("oneOf", []):
        kind = choice["properties"]["type"]["const"]
        yield f"**{path} of type {kind}**\n"
        yield from fields(choice, path)
    if isinstance(schema.get("items"), dict):
        yield from fields(schema["items"], path + "[]")
    for name, field in schema.get("properties", {}).items():
        what = field.get("type") or " or ".join(one.get("type", "") for one in field.get("anyOf", []))
        what = json.dumps(field["const"]) if "const" in field else " ".join(map(json.dumps, field["enum"])) if "enum" in field else what
        bounds = [f"{word} {field[key]}" for key, word in (("minimum", "from"), ("maximum", "to"), ("minItems", "at least"),
                                                           ("maxItems", "at most")) if key in field]
        bounds += ["required"] * (name in schema.get("required", [])) + ["default " + json.dumps(field[key]) for key in field if key == "default"]
        yield f"`{path}{'.' if path else ''}{name}`\n: {escaped(', '.join([what, *bounds]))}\n"
        yield from fields(field, f"{path}{'.' if path else ''}{name}")


def write_documents(folder):
    out = []
    for file in sorted(glob.glob(root + "/docs/*.schema.json")):
        schema = json.loads(read(file))
        out += [f"\n## {schema['title']}\nIts JSON Schema: [{os.path.basename(file)}](../docs/{os.path.basename(file)}).\n",
                *fields(schema)]
    write(folder + "/documents.md", "# Documents\nFields of what commands read and write as JSON.\n" + "\n".join(out))


def write_python(folder):
    modules = [os.path.basename(file)[:-3] for file in sorted(glob.glob(root + "/python/flexor/[a-z]*.py"))]
    out = ["# Python", "```{eval-rst}\n.. automodule:: flexor\n   :imported-members:\n```",
           *(f"```{{eval-rst}}\n.. automodule:: flexor.{module}\n```" for module in modules)]
    write(folder + "/python.md", "\n\n".join(out))


def write(file, text):
    os.makedirs(os.path.dirname(file), exist_ok=True)
    with open(file, "w") as page:
        page.write(text + "\n")


def edit(app, name, source):
    file = app.env.doc2path(name)
    if file.endswith(".hpp"):
        source[0] = page_of_header(source[0], name + ".hpp")
    elif not name.startswith("reference/"):
        source[0] = with_links_to_headers(source[0], name, app.env.found_docs)
    if name == root_doc:
        source[0] = with_sidebar(source[0])
    if name == "docs/gallery":
        source[0] += "\n## Whole reports\nOf the twin: <a href='../reports/hand/report.html'>a hand of five joints</a>, " \
                     "<a href='../reports/experiment/report.html'>the experiment</a>.\n"
    if name == "docs/adr/README":
        source[0] += "\n```{toctree}\n:glob:\n\n0*\n```\n"
    if name == "docs/code":
        source[0] += toctree([link for link in links_of(source[0]) if link.startswith("../")])


# What keyboards and screen readers need.
def make_accessible(app, name, template, context, doctree):
    context["body"] = context.get("body", "").replace("<pre>", '<pre tabindex="0">')
    context["furo_navigation_tree"] = context["furo_navigation_tree"].replace('role="heading"', 'role="heading" aria-level="2"')


# The gallery's reports, the first page, and two files that Debian's furo would take from elsewhere.
def finish(app, error):
    out, twin = str(app.outdir), app.srcdir + "/twin"
    output_of("twin", "record", "--out", twin)
    output_of("identify", "--pair", twin + "/glove-1.csv", twin + "/camera-1.csv", "--structure", "hw", "--report", out + "/reports/hand")
    output_of("experiment", "--trials", "24", "--out", out + "/reports/experiment")
    write(out + "/index.html", '<!doctype html><meta http-equiv="refresh" content="0; url=docs/README.html"><title>Flexor</title>')
    style, script = out + "/_static/styles/furo.css", out + "/_static/scripts/furo.js"
    write(style, re.sub(r"^@import url\(/javascript.*", "", read("/usr/share/javascript/normalize.css/normalize.css") + read(style), flags=re.M))
    write(script, re.sub(r"^import .*", "", read(out + "/_static/scripts/gumshoe-patched.js") + read(script), flags=re.M))


def setup(app):
    for write_part in (write_commands, write_documents, write_python):
        write_part(app.srcdir + "/reference")
    app.connect("source-read", edit)
    app.connect("html-page-context", make_accessible, priority=900)
    app.connect("build-finished", finish)
