# A host: host.sh NAME FOLDER OUT, in its own namespaces, of which this is the first process.
#
# It ends when its standard input is closed. The kernel then removes every other process of the
# host, its files in memory and its network.
set -eu
hostname "$1"
# The names of both hosts, and nothing from the machine that would differ between two hosts.
mount --bind "$2/names" /etc/hosts
mount -t tmpfs tmpfs /run
mount -t tmpfs tmpfs /dev/shm
mkdir /run/sshd
ip link set lo up
echo "made"
# The other process makes the links now.
read -r _
# The folder of a run is only on the first host.
[ "$1" = node1 ] || mount -t tmpfs tmpfs "$3"
"$(command -v sshd || echo /usr/sbin/sshd)" -f "$2/sshd_config" -E "$2/$1.log"
echo "ready"
cat >/dev/null
