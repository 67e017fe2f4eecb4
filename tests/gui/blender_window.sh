#!/usr/bin/env bash
# blender_window.sh - a throw-away, real Blender GUI for testing an add-on.
#
# Makes a Debian chroot with Blender, installs extension zips in a fresh user
# profile, starts Blender's GUI under Xvfb with software OpenGL, runs a Python
# driver script in it and leaves the screenshots in a folder.
#
#   blender_window.sh [options]                       set up (or reuse) the chroot
#   blender_window.sh [options] DRIVER.py [ARG...]    set up, then run the GUI
#   blender_window.sh [options] --exec CMD [ARG...]   run CMD in the chroot, in the
#                                                  current folder (read-write)
# Options
#   --dir DIR      where the chroot lives. Default: $BLENDER_GUI_DIR, else
#                  $XDG_CACHE_HOME/blender-gui, else ./.blender-gui
#   --suite NAME   Debian suite: sid (default; newest Blender) or trixie (4.3)
#   --mirror URL   Debian mirror (default: the first one that this machine's apt uses)
#   --ext ZIP      extension to install and enable; may be repeated
#   --out DIR      screenshots and log (default: ./blender-gui-out)
#   --data PATH    file or folder, seen read-only in $BLENDER_GUI_DATA; repeatable
#   --blend FILE   .blend file to open instead of the default scene
#   --size WxH     screen size (default: 1600x900)
#   --timeout S    kill Blender after S seconds of its processor time, or if it uses none for 300 s (default: 300)
#   --keep-profile keep Blender's user profile of the last run (default: fresh)
#   --net          leave the network reachable (default: none while it runs)
#   --update       refresh the packages of an existing chroot
#
# Exit status: 0 the driver ended well; 1 the driver or Blender failed;
# 2 wrong use; 3 set-up failed; 4 an extension did not install; 124 time-out.
#
# Needs root, unshare (util-linux) and a Debian mirror. All mounts live in a
# private mount namespace and all processes in a private PID namespace, so both
# vanish with this script, however it ends.
{ # read whole before it runs, so that an edit cannot disturb a running one
set -euo pipefail

say() { printf 'blender_window: %s\n' "$*" >&2; }
die() { local rc=$1; shift; say "ERROR: $*"; exit "$rc"; }
usage() { sed -n '2,/^{/{/^#/s/^# \{0,1\}//p}' "$0"; }

suite=${BLENDER_GUI_SUITE:-sid}
mirror=${BLENDER_GUI_MIRROR:-$(cat /etc/apt/sources.list /etc/apt/sources.list.d/*debian*.sources /etc/apt/sources.list.d/*.list 2>/dev/null |
    sed -nE 's/^(URIs:|deb )[^#]*(https?:[^ ]*\/debian)\/?( .*)?$/\2/p' | head -n 1 || true)}
dir=${BLENDER_GUI_DIR:-${XDG_CACHE_HOME:+$XDG_CACHE_HOME/blender-gui}}
dir=${dir:-.blender-gui}
out=blender-gui-out size=1600x900 limit=300 blend='' keep='' net='' update='' mode=setup
exts=() data=()
arg() { [ $# -ge 2 ] || die 2 "$1 needs a value"; }
while [ $# -gt 0 ]; do
    case $1 in
        --dir) arg "$@"; dir=$2; shift 2;;
        --suite) arg "$@"; suite=$2; shift 2;;
        --mirror) arg "$@"; mirror=$2; shift 2;;
        --ext) arg "$@"; exts+=("$2"); shift 2;;
        --out) arg "$@"; out=$2; shift 2;;
        --data) arg "$@"; data+=("$2"); shift 2;;
        --blend) arg "$@"; blend=$2; shift 2;;
        --size) arg "$@"; size=$2; shift 2;;
        --timeout) arg "$@"; limit=$2; shift 2;;
        --keep-profile) keep=1; shift;;
        --net) net=1; shift;;
        --update) update=1; shift;;
        --exec) mode=exec; shift; [ $# -gt 0 ] || die 2 "--exec needs a command"; break;;
        -h|--help) usage; exit 0;;
        --) shift; [ $# -gt 0 ] && mode=gui; break;;
        -*) die 2 "unknown option $1 (see --help)";;
        *) mode=gui; break;;
    esac
done
[[ $size =~ ^[0-9]+x[0-9]+$ ]] || die 2 "--size wants WxH, not '$size'"
[[ $limit =~ ^[0-9]+$ ]] || die 2 "--timeout wants seconds, not '$limit'"
[ -n "$mirror" ] || die 3 "no Debian mirror in this machine's apt sources: give --mirror URL"
[[ $suite =~ ^[a-z]+$ ]] || die 2 "--suite wants a suite name, not '$suite'"
if [ "$mode" = gui ]; then
    driver=$1; shift
    [ -f "$driver" ] || die 2 "no driver script '$driver'"
    driver=$(realpath "$driver")
fi
for f in ${exts+"${exts[@]}"}; do [ -f "$f" ] || die 2 "no extension zip '$f'"; done
for f in ${data+"${data[@]}"}; do [ -e "$f" ] || die 2 "no such --data '$f'"; done
[ -z "$blend" ] || [ -f "$blend" ] || die 2 "no .blend file '$blend'"
[ "$(id -u)" = 0 ] || die 3 "run this as root (chroot and mount namespaces need it)"
command -v unshare >/dev/null || die 3 "unshare not found (package util-linux)"
unshare -m -p -f true 2>/dev/null ||
    die 3 "cannot make mount and PID namespaces here (container without CAP_SYS_ADMIN?)"

here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
mkdir -p "$dir"; dir=$(realpath "$dir")
root=$dir/$suite stamp=$dir/$suite.ready log=$dir/$suite.setup.log

# --- run a shell script (text in $1) in private namespaces ---------------------
leash=      # where setpriv can do it, everything ends even if this script is killed
if setpriv --pdeathsig KILL true 2>/dev/null; then leash='setpriv --pdeathsig KILL'; fi
child=
trap 'rc=$?; [ -z "$child" ] || kill -KILL "$child" 2>/dev/null || true; exit $rc' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
private() {     # private "unshare flags" SCRIPT ARG...
    local flags=$1 rc=0; shift
    # shellcheck disable=SC2086
    $leash unshare -m -p -f --kill-child $flags bash -c "$1" blender_gui "${@:2}" &
    child=$!
    wait "$child" || rc=$?
    child=
    return $rc
}
enter='set -eu; root=$1; shift
mount --make-rprivate /
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
'

# --- the chroot ------------------------------------------------------------------
# Blender (Debian) does not depend on the Python modules that the official build
# bundles; without cattrs its own extension system fails to register.
packages="blender python3-numpy python3-requests python3-zstandard python3-cattr
 xvfb xauth xdotool imagemagick libgl1-mesa-dri libglx-mesa0 libegl1 libgl1"
want="3 $suite $mirror $(echo $packages)"
setup() {
    exec 9>"$dir/$suite.lock"
    flock -n 9 || { say "waiting for another set-up of $root"; flock 9; }
    if [ -z "$update" ] && [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$want" ] &&
        [ -x "$root/usr/bin/blender" ]; then
        exec 9>&-; return 0
    fi
    rm -f "$stamp"; : >"$log"
    if ! command -v debootstrap >/dev/null; then
        command -v apt-get >/dev/null || die 3 "debootstrap not found; install it"
        say "installing debootstrap"
        { apt-get -q update || true
          DEBIAN_FRONTEND=noninteractive apt-get -qy --no-install-recommends install debootstrap
        } >>"$log" 2>&1 || die 3 "could not install debootstrap (see $log)"
    fi
    local free; free=$(df -Pk "$dir" | awk 'NR==2{print int($4/1024)}')
    [ "$free" -ge 3000 ] || die 3 "only $free MiB free in $dir; 3000 MiB wanted"
    if [ ! -f "$dir/$suite.base" ] || [ ! -x "$root/usr/bin/apt-get" ]; then
        say "making a Debian $suite chroot in $root (log: $log)"
        rm -rf --one-file-system "$root"; rm -f "$dir/$suite.base"
        private "" 'mount --make-rprivate /; exec nice -n 10 debootstrap --variant=minbase "$@"' \
            "$suite" "$root" "$mirror" >>"$log" 2>&1 </dev/null ||
            { tail -n 5 "$log" >&2; die 3 "debootstrap failed (see $log, and is $mirror reachable?)"; }
        : >"$dir/$suite.base"
    fi
    # A frozen mirror has an expired Release file; documentation is dead weight.
    printf 'Acquire::Check-Valid-Until "false";\nAPT::Install-Recommends "false";\nAcquire::Retries "3";\n' \
        >"$root/etc/apt/apt.conf.d/99blender-gui"
    printf 'path-exclude /usr/share/%s/*\n' doc man info locale >"$root/etc/dpkg/dpkg.cfg.d/99blender-gui"
    ln -sf /proc/self/mounts "$root/etc/mtab"
    [ ! -f /etc/resolv.conf ] || cp -L --remove-destination /etc/resolv.conf "$root/etc/resolv.conf"
    say "installing Blender in it"
    private "" "$enter"'export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8
        chroot "$root" apt-get -q update
        nice -n 10 chroot "$root" apt-get -qy install "$@"
        chroot "$root" apt-get clean
        rm -rf "$root"/var/lib/apt/lists/*' "$root" $packages >>"$log" 2>&1 </dev/null ||
        { tail -n 5 "$log" >&2; die 3 "installing the packages failed (see $log)"; }
    mkdir -p "$root/gui"
    printf '%s' "$want" >"$stamp"
    exec 9>&-
}
setup
blender_exec='export LC_ALL=C.UTF-8 HOME=/gui/home PYTHONDONTWRITEBYTECODE=1
export LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe
'
if [ "$mode" = setup ]; then
    say "ready: $(private "" "$enter$blender_exec"'chroot "$root" blender --version' "$root" 2>/dev/null | head -n 1) in $root"
    exit 0
fi

# --- a folder of this run, seen as /gui in the chroot ------------------------------
for old in "$dir"/run.*.*; do     # left by a killed run
    pid=${old#"$dir"/run.}; pid=${pid%%.*}
    if [ -d "$old" ] && [[ $pid =~ ^[0-9]+$ ]] && ! kill -0 "$pid" 2>/dev/null; then
        rm -rf --one-file-system "$old"
    fi
done
run=$(mktemp -d "$dir/run.$$.XXXXXX")
trap 'rc=$?; [ -z "$child" ] || kill -KILL "$child" 2>/dev/null || true
      rm -rf --one-file-system "$run"; exit $rc' EXIT
mkdir -p "$run"/{lib,driver,ext,data,out,work,home}
[ -z "$keep" ] || mkdir -p "$dir/$suite.home"
binds=()
[ -z "$keep" ] || binds+=("$dir/$suite.home" "$run/home" rw)
for f in ${data+"${data[@]}"}; do
    f=$(realpath "$f"); t=$run/data/$(basename "$f")
    if [ -d "$f" ]; then mkdir -p "$t"; else : >"$t"; fi
    binds+=("$f" "$t" ro)
done
mount_binds='mkdir -p "$root/gui"; n=$1; shift
while [ "$n" -gt 0 ]; do
    mount --rbind "$1" "$2"; [ "$3" = rw ] || mount -o remount,bind,ro "$2"; shift 3; n=$((n - 3))
done
mount --rbind "$1" "$root/gui"; shift
'
netflag=-n; [ -z "$net" ] || netflag=
[ -z "$netflag" ] || unshare -n true 2>/dev/null || { say "note: cannot cut the network off here"; netflag=; }

if [ "$mode" = exec ]; then
    binds+=("$PWD" "$run/work" rw)
    rc=0
    private "$netflag" "$enter$mount_binds$blender_exec"'exec chroot "$root" sh -c "cd /gui/work && exec \"\$@\"" sh "$@"' \
        "$root" ${#binds[@]} "${binds[@]}" "$run" "$@" || rc=$?
    exit $rc
fi

mkdir -p "$out"; out=$(realpath "$out")
binds+=("$out" "$run/out" rw "$(dirname "$driver")" "$run/driver" ro "$here" "$run/lib" ro)
n=0
for f in ${exts+"${exts[@]}"}; do n=$((n + 1)); mkdir -p "$run/ext/$n"; cp "$f" "$run/ext/$n/"; done
blendarg=
if [ -n "$blend" ]; then blendarg=/gui/scene/$(basename "$blend"); mkdir "$run/scene"; cp "$blend" "$run/scene/"; fi

# Runs before the driver, in Blender: no splash, no dialogs, no second window.
cat >"$run/boot.py" <<'PY'
import sys
import bpy
sys.path.insert(0, "/gui/lib")
view = bpy.context.preferences.view
view.show_splash = False
view.render_display_type = 'NONE'
bpy.context.preferences.use_preferences_save = False
bpy.context.preferences.filepaths.use_auto_save_temporary_files = False
PY
cat >"$run/run.sh" <<'SH'
# In the chroot. $1 size, $2 time-out, $3 driver, $4 .blend or empty, then arguments
set -u
size=$1 limit=$2 driver=$3 blend=$4; shift 4
B=0 X=0
trap 'kill $B $X 2>/dev/null; exit 143' TERM INT
out=/gui/out
rm -f $out/status.txt
: >$out/blender.log
for z in /gui/ext/*/*.zip; do
    [ -e "$z" ] || continue
    # install-file exits 0 even where it fails: trust its message only
    blender --offline-mode --command extension install-file --repo user_default --enable "$z" \
        </dev/null >$out/install.log 2>&1
    cat $out/install.log >>$out/blender.log
    if ! grep -q '^STATUS Installed\|^STATUS Re-Installed' $out/install.log || grep -q '^Traceback' $out/install.log; then
        echo "blender_window: ERROR: extension $(basename "$z") did not install:" >&2
        cat $out/install.log >&2; exit 4
    fi
    rm -f $out/install.log
done
Xvfb -displayfd 3 -screen 0 ${size}x24 -nolisten tcp 3>/tmp/display >/tmp/xvfb.log 2>&1 &
X=$!
for i in $(seq 100); do
    [ -s /tmp/display ] && break
    kill -0 $X 2>/dev/null || break
    sleep 0.1
done
if ! [ -s /tmp/display ]; then echo "blender_window: ERROR: Xvfb did not start:" >&2; cat /tmp/xvfb.log >&2; exit 1; fi
export DISPLAY=:$(cat /tmp/display) BLENDER_GUI_OUT=$out BLENDER_GUI_DATA=/gui/data
blender --offline-mode --window-geometry 0 0 ${size%x*} ${size#*x} $blend \
    --python-exit-code 1 --python /gui/boot.py --python "$driver" -- "$@" </dev/null >>$out/blender.log 2>&1 &
B=$!
# Seconds of the clock would depend on what else the machine does.
used() { sed 's/.*) //' /proc/$B/stat | awk -v hertz="$(getconf CLK_TCK)" '{print int(($12 + $13) / hertz)}'; }
( before=-1 rests=0
  while now=$(used) && [ -n "$now" ] && [ "$now" -lt "$limit" ] && [ $rests -lt 300 ]; do
      if [ "$now" = $before ]; then rests=$((rests + 1)); else rests=0; fi
      before=$now
      sleep 1
  done
  [ -n "$now" ] || exit
  echo "$now" >/tmp/timeout; import -window root $out/timeout.png; kill -KILL $B ) 2>/dev/null &
W=$!
rc=0; wait $B || rc=$?
kill $W 2>/dev/null
tail -n 60 $out/blender.log
if [ -e /tmp/timeout ]; then echo "blender_window: ERROR: stopped after $(cat /tmp/timeout) s of processor time (see timeout.png)" >&2; exit 124; fi
if [ $rc != 0 ]; then echo "blender_window: ERROR: Blender ended with status $rc (see blender.log)" >&2; exit 1; fi
if [ -e $out/status.txt ] && ! grep -qx ok $out/status.txt; then
    echo "blender_window: ERROR: the driver failed (see blender.log)" >&2; exit 1
fi
SH
rc=0
private "$netflag" "$enter$mount_binds$blender_exec"'ip link set lo up 2>/dev/null || true
chroot "$root" bash /gui/run.sh "$@" & c=$!
trap "kill \$c" TERM INT
wait $c' \
    "$root" ${#binds[@]} "${binds[@]}" "$run" \
    "$size" "$limit" "/gui/driver/$(basename "$driver")" "$blendarg" "$@" || rc=$?
say "output in $out: $(cd "$out" && ls | tr '\n' ' ')"
exit $rc
}
