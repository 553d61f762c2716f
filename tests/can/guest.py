#!/usr/bin/env python3
"""Run a command in a QEMU guest whose kernel has CAN, with this machine's files.

usage: tests/can/guest.py WORK COMMAND...
  WORK     folder that the guest may write to; there it is /mnt/shared
  COMMAND  run as root in the repository; its output goes to WORK/output.txt and to here

The kernel is the distribution's, unpacked from build/can/linux-image.deb (tools/setup can). The
guest's root is this machine's, read-only, over 9p; /mnt is its own. Exit code of the command; 77
if there is no guest to be had, and why in one line.
"""
import glob
import lzma
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "build" / "can" / "linux-image.deb"
GUEST = ROOT / "build" / "can" / "guest"
MODULES = ("virtio_pci", "9pnet_virtio", "9p", "can_raw", "vcan", "sch_tbf")
SKIP = 77
TIMEOUT_S = 3000  # less than tests/run.py allows a suite: the guest is ended with its console
PROGRAMS = ("qemu-system-x86_64", "busybox", "modprobe", "depmod", "cpio", "dpkg-deb")

INIT = """\
#!/bin/sh
B=/bin/busybox
$B mount -t proc proc /proc; $B mount -t sysfs sys /sys; $B mount -t devtmpfs dev /dev
$B dmesg -n 1
for module in $($B cat /modules/order); do $B insmod /modules/$module; done
NINE=trans=virtio,version=9p2000.L,msize=262144
$B mount -t 9p -o $NINE,cache=loose,ro root /root
for name in proc sys dev; do $B mount --bind /$name /root/$name; done
$B mount -t tmpfs tmpfs /root/mnt; $B mkdir -p /root/mnt/shared /root/mnt/tmp /root/dev/shm
$B mount -t tmpfs tmpfs /root/dev/shm
$B mount -t 9p -o $NINE work /root/mnt/shared
$B ip link set lo up
$B chroot /root /usr/bin/env -i PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin HOME=/mnt/tmp \\
    TMPDIR=/mnt/tmp LANG=C.UTF-8 PYTHONDONTWRITEBYTECODE=1 /bin/sh /mnt/shared/command.sh \\
    </dev/null >/root/mnt/shared/output.txt 2>&1
code=$?
$B sync
# the device isa-debug-exit ends QEMU with 2 code + 1
$B printf "\\\\$($B printf %o $code)" | $B dd of=/dev/port bs=1 seek=244 conv=notrunc 2>/dev/null
$B poweroff -f
"""


def skip(reason):
    print(f"no guest with CAN: {reason}")
    sys.exit(SKIP)


def run(*words, **more):
    return subprocess.run(list(map(str, words)), check=True, stdout=subprocess.PIPE, **more).stdout


def modules_of(kernel, version):
    """Paths of the modules and of what they need, in the order of loading."""
    paths = []
    for name in MODULES:
        shown = run("modprobe", "-d", kernel, "-S", version, "-D", name, text=True)
        for path in re.findall(r"^insmod (\S+)", shown, re.MULTILINE):
            if path not in paths:
                paths.append(path)
    return paths


def make_guest():
    """Kernel and first root file system from the package."""
    shutil.rmtree(GUEST, ignore_errors=True)
    kernel, tree = GUEST / "kernel", GUEST / "tree"
    for folder in ("bin", "proc", "sys", "dev", "root", "modules"):
        (tree / folder).mkdir(parents=True)
    run("dpkg-deb", "-x", PACKAGE, kernel)
    if not (kernel / "lib").exists():
        (kernel / "lib").symlink_to("usr/lib")
    version = os.path.basename(glob.glob(f"{kernel}/lib/modules/*")[0])
    run("depmod", "-b", kernel, version)
    names = []
    for path in map(pathlib.Path, modules_of(kernel, version)):
        names.append(path.name.removesuffix(".xz"))
        data = path.read_bytes()
        (tree / "modules" / names[-1]).write_bytes(
            lzma.decompress(data) if path.suffix == ".xz" else data)
    (tree / "modules" / "order").write_text("\n".join(names) + "\n")
    shutil.copy(shutil.which("busybox"), tree / "bin")
    (tree / "bin" / "sh").symlink_to("busybox")
    (tree / "init").write_text(INIT)
    (tree / "init").chmod(0o755)
    files = "\n".join(sorted(str(path.relative_to(tree)) for path in tree.rglob("*")))
    (GUEST / "initrd").write_bytes(run("cpio", "-o", "-H", "newc", "--quiet", cwd=tree,
                                       input=files.encode()))
    shutil.copy(glob.glob(f"{kernel}/boot/vmlinuz-*")[0], GUEST / "vmlinuz")
    shutil.rmtree(kernel)


def boot(work):
    """Exit code of the command, None if the guest did not come to its end."""
    def folder(name, path, access=""):
        share = f"local,id={name},path={path},security_model=none,multidevs=remap{access}"
        return ("-fsdev", share,
                "-device", f"virtio-9p-pci,fsdev={name},mount_tag={name}")
    words = ["qemu-system-x86_64", "-M", "pc", "-accel", "tcg", "-cpu", "max", "-m", "1024",
             "-nodefaults", "-display", "none", "-serial", f"file:{work}/console.txt",
             "-no-reboot", "-kernel", GUEST / "vmlinuz", "-initrd", GUEST / "initrd",
             "-append", "console=ttyS0 panic=-1 quiet", *folder("root", "/", ",readonly=on"),
             *folder("work", work), "-device", "isa-debug-exit,iobase=0xf4,iosize=0x04"]
    try:
        code = subprocess.run(list(map(str, words)), stdin=subprocess.DEVNULL, check=False,
                              timeout=TIMEOUT_S).returncode
    except subprocess.TimeoutExpired:
        return None
    return code >> 1 if code & 1 else None


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        skip(f"{missing[0]} is not installed; run tools/setup can")
    if not PACKAGE.is_file():
        skip(f"{PACKAGE} is missing; run tools/setup can")
    newest = max(PACKAGE.stat().st_mtime, os.path.getmtime(__file__))
    if not (GUEST / "vmlinuz").is_file() or (GUEST / "vmlinuz").stat().st_mtime < newest:
        make_guest()
    work = pathlib.Path(sys.argv[1]).resolve()
    work.mkdir(parents=True, exist_ok=True)
    (work / "command.sh").write_text(f"cd {shlex.quote(str(ROOT))} && {shlex.join(sys.argv[2:])}\n")
    (work / "output.txt").unlink(missing_ok=True)
    code = boot(work)
    output = work / ("output.txt" if (work / "output.txt").is_file() else "console.txt")
    print(output.read_text(errors="replace"), end="")
    if code is None:
        sys.exit("the guest did not come to its end; its console is in console.txt of " + str(work))
    return code


if __name__ == "__main__":
    sys.exit(main())
