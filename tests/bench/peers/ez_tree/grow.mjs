// Grows a broadleaf tree with ez-tree (preset Oak Large, seed 12345) and writes its triangles.
//
//     node grow.mjs TRIANGLES
//
// TRIANGLES becomes a file of little-endian f32, nine for each triangle: branches, then leaves.

import { writeFileSync } from 'node:fs';

// ez-tree loads pictures of bark while it is imported. Nobody looks at them here.
globalThis.document = {
	createElementNS: () => ( { addEventListener() {}, removeEventListener() {}, style: {} } ),
};
const { Tree } = await import( '@dgreenheck/ez-tree' );

const tree = new Tree();
tree.loadPreset( 'Oak Large' );
tree.options.seed = 12345;
tree.generate();
tree.updateMatrixWorld( true );

const numbers = [];
for ( const mesh of [ tree.branchesMesh, tree.leavesMesh ] ) {

	const geometry = mesh.geometry.clone().applyMatrix4( mesh.matrixWorld );
	const corners = geometry.index ? geometry.toNonIndexed() : geometry;
	numbers.push( ...corners.getAttribute( 'position' ).array );

}

writeFileSync( process.argv[ 2 ], new Uint8Array( Float32Array.from( numbers ).buffer ) );
