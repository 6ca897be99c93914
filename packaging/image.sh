#!/usr/bin/env bash
# packaging/image.sh: an OCI image of the program, out/image/trihedron-VERSION.oci.tar: a root of Debian with the package of out/deb in it, fetched and
# installed by mmdebstrap; buildah then takes it as it is, without a network and without running anything.
set -euo pipefail
cd "$(dirname "$0")/.."
compgen -G 'out/deb/trihedron_*.deb' > /dev/null || { echo 'image: there is no package of the program in out/deb; run make deb' >&2; exit 2; }
version=$(dpkg-deb --field out/deb/trihedron_*.deb Version)
out=out/image
buildah=(buildah --root "$PWD/$out/storage" --runroot "$PWD/$out/run" --storage-driver vfs)

rm -rf "$out"
mkdir -p "$out"
packaging/root.sh "$out/root" trihedron
container=$("${buildah[@]}" from scratch)
"${buildah[@]}" add --quiet "$container" "$out/root" / > /dev/null
"${buildah[@]}" config --entrypoint '["/usr/bin/trihedron"]' --cmd --help --workingdir /data --env LANG=C.UTF-8 \
  --label org.opencontainers.image.title=trihedron --label "org.opencontainers.image.version=$version" \
  --label org.opencontainers.image.licenses=Apache-2.0 "$container"
"${buildah[@]}" commit --quiet --disable-compression=false "$container" "oci-archive:$out/trihedron-$version.oci.tar:trihedron:$version" > /dev/null
"${buildah[@]}" rm "$container" > /dev/null
rm -rf "$out/root" "$out/storage" "$out/run"
ls -l "$out"
