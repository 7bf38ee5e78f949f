# shellcheck shell=bash
# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
# Sourced by ./run and ./check: makes the project's own Python environment, once, and says how.
# The caller sets $root, the folder of the clone.
#
#   LG_HUSKY_VENV    folder of the environment (default: .venv here, .venv-<distro> with ROS)
#   LG_HUSKY_PYTHON  interpreter to make it with (default: python3, else python3.12, python3.11)
#   LG_HUSKY_LOCKED  1: exactly the versions of requirements.lock
#   LG_HUSKY_UV      0: pip even where uv is installed (uv is faster; pip is the fallback)

: "${root:?}"

fail() {
    printf 'error: %s\n' "$1" >&2
    exit 1
}

room_at() {
    # room_at FOLDER: what is free there [MB].
    df -Pm "$1" | awk 'NR == 2 { print $4 }'
}

ros_is_sourced() {
    [ -n "${AMENT_PREFIX_PATH:-}" ] && [ -n "${ROS_DISTRO:-}" ]
}

usable_python() {
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))' 2>/dev/null
}

find_python() {
    local candidate
    if [ -n "${LG_HUSKY_PYTHON:-}" ]; then
        usable_python "$LG_HUSKY_PYTHON" ||
            fail "LG_HUSKY_PYTHON=$LG_HUSKY_PYTHON is no Python 3.11, 3.12 or 3.13"
        command -v "$LG_HUSKY_PYTHON"
        return
    fi
    for candidate in python3 python3.12 python3.11; do
        if command -v "$candidate" >/dev/null && usable_python "$candidate"; then
            command -v "$candidate"
            return
        fi
        # rclpy is compiled for the system's python3; another one could not load it.
        ros_is_sourced && break
    done
    fail "no Python 3.11, 3.12 or 3.13 found (python3 is $(python3 -V 2>&1)); on Debian or Ubuntu: \
sudo apt install python3 python3-venv"
}

stamp_of() {
    # What the installed environment depends on; a change of any of it installs again.
    { printf '%s\n' "$1" "$root" "${ROS_DISTRO:-no ROS}"
      [ "${LG_HUSKY_LOCKED:-0}" = 1 ] && cat "$root/requirements.lock"
      cat "$root/setup.py" "$root/setup.cfg" "$root/pyproject.toml" "$root/package.xml"; } |
        sha256sum | cut -d ' ' -f 1
}

stamp_is_current() {
    [ -x "$venv/bin/python" ] && [ "$(cat "$venv/.lg_husky_$1" 2>/dev/null)" = "$(stamp_of "$1")" ]
}

show_progress() {
    # One line that grows on a terminal, one line a stage elsewhere.
    if [ -t 2 ]; then
        awk '/^Collecting |^Requirement already/ { n++; printf "\r  %d packages looked at ", n }
             /^Installing collected/ { printf "\r  installing them (the longest part)  " }
             /^Successfully/ { printf "\r  done                                 \n" }
             { fflush() }' >&2
    else
        awk '/^Collecting / { if (++n % 20 == 0) printf "  %d packages collected\n", n }
             /^Installing collected/ { print "  installing them" }
             { fflush() }' >&2
    fi
}

has_uv() {
    [ "${LG_HUSKY_UV:-1}" != 0 ] && command -v uv >/dev/null
}

install_with_uv() {
    # install_with_uv LOG: true if uv installed everything; what it lacks, pip may still reach.
    local code
    uv pip install --quiet --python "$venv/bin/python" "${constraints[@]}" \
        --editable "${root}[${extra}]" >"$1" 2>&1
    code=$?
    [ "$code" -eq 0 ] || echo "  uv could not install it (see $1): trying pip" >&2
    return "$code"
}

install_project() {
    # install_project LOG [OPTION...]: what is needed, from the network unless options say no.
    local log=$1
    shift
    PIP_RETRIES=${PIP_RETRIES:-2} PIP_DISABLE_PIP_VERSION_CHECK=1 "$venv/bin/python" -m pip \
        install --progress-bar off "${constraints[@]}" "$@" \
        --editable "${root}[${extra}]" 2>&1 |
        tee "$log" | show_progress
    grep -q '^Successfully installed .*lg[-_]husky[-_]sim' "$log"
}

make_environment() {
    # make_environment EXTRA: sets $venv to an environment with the project and that extra.
    local extra=$1 python log options=() constraints=()
    if ros_is_sourced; then
        venv=${LG_HUSKY_VENV:-$root/.venv-$ROS_DISTRO}
    else
        venv=${LG_HUSKY_VENV:-$root/.venv}
    fi
    case $venv in /*) ;; *) venv=$PWD/$venv ;; esac
    stamp_is_current "$extra" && return

    if command -v flock >/dev/null && mkdir -p "$(dirname "$venv")" &&
            exec 9>"$venv.lock"; then
        flock -n 9 || { echo "waiting for another set-up of $venv" >&2; flock 9; }
        stamp_is_current "$extra" && { exec 9>&-; return; }
    fi

    python=$(find_python) || exit 1
    if ros_is_sourced; then
        options=(--system-site-packages)
        # ROS messages are compiled for the system's numpy 1.
        constraints=(--constraint "$root/scripts/ros_constraints.txt")
    fi
    if [ "${LG_HUSKY_LOCKED:-0}" = 1 ]; then
        constraints+=(--constraint "$root/requirements.lock")
    fi
    # An environment of a clone that has moved, or of a Python that has gone, is made anew.
    if [ -e "$venv" ] && { ! "$venv/bin/python" -c '' 2>/dev/null ||
            ! head -n 1 "$venv/bin/pip" 2>/dev/null | grep -qF "$venv/bin/python"; }; then
        [ -f "$venv/.lg_husky_made" ] || fail "$venv is no working Python environment with pip, and \
not of our making; remove it, or name another folder in LG_HUSKY_VENV"
        rm -rf "$venv"
    fi
    if [ ! -x "$venv/bin/python" ]; then
        "$python" -c 'import ensurepip, venv' 2>/dev/null ||
            fail "$python has no venv module; on Debian or Ubuntu: sudo apt install python3-venv"
        echo "setting up $venv with $("$python" -V 2>&1) (once; a few minutes, some 950 MB)" >&2
        mkdir -p "$venv" && touch "$venv/.lg_husky_made"
        # pip comes along with uv too: what is added later by hand needs it.
        { has_uv && uv venv --quiet --seed --allow-existing --python "$python" "${options[@]}" \
            "$venv" 2>/dev/null; } ||
            "$python" -m venv "${options[@]}" "$venv" || fail "could not make $venv"
    else
        echo "updating $venv" >&2
    fi
    log=$venv/install.log
    { has_uv && install_with_uv "$log.uv"; } || install_project "$log" || install_project "$log.offline" --no-index --no-build-isolation || {
        grep '^ERROR' "$log" | tail -n 3 >&2
        if grep -qiE 'NewConnectionError|name resolution|Network is unreachable|Connection (refused|timed out|reset)|ReadTimeout|ProxyError|Name or service not known|Max retries' "$log"; then
            fail "there is no network to install from: connect, or set LG_HUSKY_VENV to an \
environment that has everything (full log: $log)"
        fi
        if grep -q 'No space left on device' "$log"; then
            fail "no room for $venv: it needs 1.3 GB, $(room_at "$venv") MB are free there and \
$(room_at "${TMPDIR:-/tmp}") MB in ${TMPDIR:-/tmp}; free some, or name another folder in LG_HUSKY_VENV"
        fi
        fail "installing failed; full log: $log"
    }
    stamp_of "$extra" >"$venv/.lg_husky_$extra"
    # The environment of ./check has all that ./run needs.
    [ "$extra" = check ] && stamp_of run >"$venv/.lg_husky_run"
    exec 9>&-
}
