#!/bin/sh
# Runs every command of a guide, in its order, as a reader would: guide.sh GUIDE BIN.
set -eu
guide=$1
PATH=$2:$PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
sed -n 's/^    //p' "$guide" >commands.sh
[ "$(grep -c nacre commands.sh)" -ge 5 ] || { echo "$guide holds no commands"; exit 1; }
sh -eu commands.sh >said.txt 2>&1 || { tail -20 said.txt; exit 1; }
