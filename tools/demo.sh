# shellcheck shell=sh
# ./upswing demo: builds the page and serves it. Read by ./upswing, whose functions it uses, after
# tools/web.sh.
: "${root:?}" "${setup:?}" "${program:?}"

# Tests have another page and another program.
page=$(readlink -m -- "${UPSWING_PAGE:-$root/build/web}")
program=${UPSWING:-$program}

demo_usage() {
  cat <<'END_OF_USAGE'
Usage: ./upswing demo [POLICY|RUN...] [--port N] [--dist FOLDER]

Serves the page in which policies swing up the pendulum live, to this machine only. Installs Node
and the page's packages and builds the page if they are missing.

  POLICY|RUN     policy.safetensors or run folder to add to the page's policies; it stays until the
                 page is built again
  --port N       port to listen on (default 4173, or the next free one)
  --dist FOLDER  new or empty folder to write the page into, for any web server, instead of serving

Examples:
  ./upswing demo
  ./upswing demo runs/d3qn-seed1
  ./upswing demo --dist site && python3 -m http.server -d site
END_OF_USAGE
}

bad_input() { say "$command: $*"; exit 2; }

# Reads the arguments: `runs` (how many there are of them, which stay as "$@"), `port`, `dist`.
demo() {
  port='' dist='' count=$#
  while [ "$count" -gt 0 ]; do
    count=$((count - 1))
    word=$1
    shift
    case $word in
      -h | --help) demo_usage; exit 0 ;;
      --port=* | --dist=*) set_demo_option "${word%%=*}" "${word#*=}" ;;
      --port | --dist)
        [ "$count" -gt 0 ] || bad_input "$word: expected a value, got none"
        count=$((count - 1))
        set_demo_option "$word" "$1"
        shift
        ;;
      -*) bad_input "unknown flag $word (see ./upswing demo --help)" ;;
      *)
        [ -e "$word" ] || bad_input "$word: no such file or folder; expected a policy or a run"
        set -- "$@" "$word" # behind the words that are still to be read
        ;;
    esac
  done
  [ -z "$dist" ] || [ -z "$port" ] || bad_input "expected --port or --dist, got both"

  build_demo
  # Only policies need the program.
  if [ $# -gt 0 ]; then
    set_up release upswing
    [ -x "$program" ] || fail "the program is not built: run ./upswing demo once without --no-setup"
  fi
  if [ -n "$dist" ]; then
    write_dist "$@"
  else
    [ $# = 0 ] || "$program" export "$@" --page "$page/agents" >&2 || exit
    serve
  fi
}

# set_demo_option FLAG VALUE
set_demo_option() {
  case $1 in
    --port)
      case $2 in
        "" | *[!0-9]* | ??????* | 0*) bad_input "--port: expected an integer in [1, 65535], got \"$2\"" ;;
      esac
      [ "$2" -le 65535 ] || bad_input "--port: expected an integer in [1, 65535], got \"$2\""
      port=$2
      ;;
    --dist)
      [ -n "$2" ] || bad_input "--dist: expected a folder, got an empty text"
      dist=${2%/}
      dist=${dist:-/}
      [ ! -e "$dist" ] || { [ -d "$dist" ] && [ -z "$(ls -A -- "$dist")" ]; } ||
        bad_input "$dist: expected a new or empty folder, got one that holds files, or a file"
      [ -d "$(dirname -- "$dist")" ] ||
        bad_input "--dist: expected the existing folder $(dirname -- "$dist") for $(basename -- "$dist")"
      ;;
  esac
}

# A checksum of all sources of the page.
page_hash() {
  (cd "$root/web" && find . \( -name node_modules -o -name tests \) -prune -o -type f -print0 |
    LC_ALL=C sort -z | xargs -0 sha256sum | sha256sum)
}

# Sets up Node, and builds the page if it is missing or made from other sources.
build_demo() {
  if [ "$setup" = no ]; then
    [ -f "$page/index.html" ] || fail "the page is not built: run ./upswing demo once without --no-setup"
    find_node || [ -n "$dist" ] || fail "Node is not installed: run ./upswing demo once without --no-setup"
    return
  fi
  set_up_node
  (
    lock
    stamp=$page.stamp
    hash=$(page_hash)
    [ ! -f "$page/index.html" ] || [ "$(cat "$stamp" 2>/dev/null)" != "$hash" ] || exit 0
    say "building the page"
    rm -f "$stamp"
    cd web
    npm run --silent build -- --logLevel error >&2 || fail "the page could not be built (see above)"
    echo "$hash" >"$stamp"
  ) </dev/null || exit 1
}

# A copy with the policies added; it appears under its name whole or not at all.
write_dist() {
  tmp=$(mktemp -d "$(dirname -- "$dist")/.upswing-page.XXXXXX") || fail "cannot write beside $dist"
  trap 'rm -rf "$tmp"' EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM
  cp -R "$page/." "$tmp/" || fail "could not copy the page (see above)"
  [ $# = 0 ] || "$program" export "$@" --page "$tmp/agents" >/dev/null || exit
  chmod =rwx "$tmp" # as the umask has it
  mv -T -- "$tmp" "$dist" || fail "could not move the page to $dist (see above)"
  case $dist in
    *[[:cntrl:]]*) echo "the page is written, for any web server" ;;
    *) echo "$dist: the page, for any web server; to look at it:" \
      "python3 -m http.server -d $(quoted "$dist")" ;;
  esac
}

# quoted WORD: as one word of a shell's command line.
quoted() {
  case $1 in
    *[!A-Za-z0-9_./,:=+@%-]*) printf "'%s'" "$(printf '%s' "$1" | sed "s/'/'\\\\''/g")" ;;
    *) printf '%s' "$1" ;;
  esac
}

serve() {
  cd "$root/web" || exit
  exec node build/serve.js "$page" ${port:+"$port"}
}
