# shellcheck shell=sh
# ./upswing docs: builds the documentation. Read by ./upswing, whose functions it uses, after
# tools/web.sh and tools/demo.sh.
: "${root:?}" "${setup:?}" "${program:?}" "${page:?}" "${packages:?}" "${python:?}"

docs=$root/build/docs
docs_venv=$root/build/docs-venv

docs_usage() {
  cat <<'END_OF_USAGE'
Usage: ./upswing docs [--serve | --site FOLDER]

Builds the documentation into build/docs: static pages with search, which work from any folder. Installs
Doxygen and, into build/docs-venv, Sphinx, if they are missing.

  --serve        serve it on this machine only
  --site FOLDER  write a complete web site: the page of ./upswing demo, the page as one file
                 (upswing.html), and the documentation in docs/; FOLDER must be new or empty

Examples:
  ./upswing docs
  ./upswing docs --serve
  ./upswing docs --site site && python3 -m http.server -d site
END_OF_USAGE
}

bad_input() { say "$command: $*"; exit 2; }

docs() {
  action=build dist=''
  while [ $# -gt 0 ]; do
    case $1 in
      -h | --help) docs_usage; exit 0 ;;
      --serve) [ "$action" = build ] || bad_input "expected --serve or --site, once"; action=serve ;;
      --site=*) set_site "${1#*=}" ;;
      --site)
        [ $# -gt 1 ] || bad_input "--site: expected a folder, got none"
        shift
        set_site "$1"
        ;;
      -*) bad_input "unknown flag $1 (see ./upswing docs --help)" ;;
      *) bad_input "did not expect \"$1\" (see ./upswing docs --help)" ;;
    esac
    shift
  done

  if [ "$setup" = yes ]; then
    set_up_docs
    # shellcheck disable=SC2046  # a list of words: all programs, whose help the reference has
    set_up release upswing $(extra_programs)
    build_docs
  fi
  [ -f "$docs/index.html" ] || fail "the documentation is not built: run ./upswing docs once" \
    "without --no-setup"
  case $action in
    serve) exec "$python" -B "$root/tools/docs.py" serve "$docs" ;;
    site) add_page && write_site ;;
    build) echo "$docs/index.html: the documentation; to look at it: ./upswing docs --serve" ;;
  esac
}

# set_site FOLDER
set_site() {
  [ "$action" = build ] || bad_input "expected --serve or --site, once"
  action=site
  [ -n "$1" ] || bad_input "--site: expected a folder, got an empty text"
  dist=${1%/}
  dist=${dist:-/}
  [ ! -e "$dist" ] || { [ -d "$dist" ] && [ -z "$(ls -A -- "$dist")" ]; } ||
    bad_input "$dist: expected a new or empty folder, got one that holds files, or a file"
  [ -d "$(dirname -- "$dist")" ] ||
    bad_input "--site: expected the existing folder $(dirname -- "$dist") for $(basename -- "$dist")"
}

# Installs Doxygen and Sphinx.
set_up_docs() {
  # shellcheck disable=SC2086  # a list of words
  (install_packages $packages doxygen && lock &&
    make_venv "the documentation" "$docs_venv" tools/docs-requirements.txt) </dev/null || exit 1
}

build_docs() {
  (lock && exec "$docs_venv/bin/python" -B tools/docs.py build "$docs") </dev/null >&2 ||
    fail "the documentation could not be built (see above)"
}

# The page of ./upswing demo, which the site contains.
add_page() {
  [ "$setup" = no ] || build_demo
  [ -f "$page/index.html" ] || fail "the page is not built: run ./upswing demo once without --no-setup"
}

# quoted WORD: as one word of a shell's command line.
quoted() {
  case $1 in
    *[!A-Za-z0-9_./,:=+@%-]*) printf "'%s'" "$(printf '%s' "$1" | sed "s/'/'\\\\''/g")" ;;
    *) printf '%s' "$1" ;;
  esac
}

# Moves the page and the documentation to their folder, complete or not at all.
write_site() {
  tmp=$(mktemp -d "$(dirname -- "$dist")/.upswing-site.XXXXXX") || fail "cannot write next to $dist"
  trap 'rm -rf "$tmp"' EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM
  { cp -R "$page/." "$tmp" && cp -R "$docs" "$tmp/docs" &&
    UPSWING_PAGE="$page" "$program" demo --file "$tmp/upswing.html" >/dev/null &&
    "$python" -B "$root/tools/docs.py" join "$tmp" &&
    # GitHub Pages leaves out folders such as _static unless this file is there.
    : >"$tmp/.nojekyll"; } || fail "could not copy the site (see above)"
  chmod =rwx "$tmp" # mode from the umask
  mv -T -- "$tmp" "$dist" || fail "could not move the site to $dist (see above)"
  case $dist in
    *[[:cntrl:]]*) echo "the site is written, for any web server" ;;
    *) echo "$dist: the site, for any web server; to look at it:" \
      "python3 -m http.server -d $(quoted "$dist")" ;;
  esac
}
